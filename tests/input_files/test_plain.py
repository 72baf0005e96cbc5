import gzip

import pytest

from input_files.plain import InputFileError, read_text

TEXT = "Bär\n" * 1000


@pytest.fixture
def compressed(tmp_path):
    path = tmp_path / "text.jsonl.gz"
    path.write_bytes(gzip.compress(TEXT.encode()))
    return path


def test_a_compressed_text_is_read_as_it_was(compressed):
    assert read_text(compressed, limit=len(TEXT.encode())) == TEXT


def test_the_limit_holds_for_the_decompressed_text(compressed):
    with pytest.raises(InputFileError, match="too large"):
        read_text(compressed, limit=len(TEXT.encode()) - 1)


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: data[:-4],
        lambda data: data[:30],
        lambda data: b"text",
        lambda data: data[:20] + b"\xff" * 20 + data[40:],
    ],
)
def test_a_damaged_one_is_named(compressed, damage):
    compressed.write_bytes(damage(compressed.read_bytes()))
    with pytest.raises(InputFileError, match=r"text\.jsonl\.gz cannot be decompressed"):
        read_text(compressed, limit=10_000)
