"""Files are read whole and within a limit, and one that cannot be read is named with the reason."""

import gzip
import os
from pathlib import Path

import pytest

from input_files.plain import InputFileError, at_home, is_number, missing_file, read_bytes, read_text, whole_number

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


def test_of_a_file_that_is_not_there_the_most_similar_one_beside_it_is_named(tmp_path):
    (tmp_path / "my-mission.toml").touch()
    (tmp_path / "my-misson.txt").touch()
    with pytest.raises(InputFileError) as said:
        read_text(tmp_path / "my-misson.toml", limit=1)
    assert str(said.value).endswith(f"(No such file or directory). Did you mean {tmp_path / 'my-mission.toml'}?")
    for other in ("cat.toml", "nowhere/my-mission.toml"):
        with pytest.raises(InputFileError, match=r"Check the path\.$"):
            read_text(tmp_path / other, limit=1)


def test_a_file_may_have_as_many_bytes_as_the_limit(tmp_path):
    (path := tmp_path / "cat.bin").write_bytes(b"1234")
    assert read_bytes(path, limit=4) == b"1234"
    with pytest.raises(InputFileError, match=r"cat\.bin is too large: more than 3e-06 MB"):
        read_bytes(path, limit=3)


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs files whose size the system does not tell")
def test_a_file_that_is_larger_than_the_system_says_is_refused():
    with pytest.raises(InputFileError, match="is too large"):
        read_bytes(Path("/proc/self/status"), limit=10)


def test_a_name_that_no_file_can_have_is_refused():
    with pytest.raises(InputFileError, match=r"^'cat\\x00\.toml' cannot be read \(.*\)\. Check the path\.$"):
        read_text(Path("cat\0.toml"), limit=1)


def test_texts_of_other_systems_are_read_without_their_marks_and_line_ends(tmp_path):
    (path := tmp_path / "cat.txt").write_bytes(b"\xef\xbb\xbfB\xc3\xa4r\r\n\r\nend\r\n")
    assert read_text(path, limit=100) == "Bär\n\nend\n"


def test_true_is_no_number():
    assert [is_number(value) for value in (1, 1.5, True, False, "1", None)] == [True, True, False, False, False, False]


def test_a_folder_and_a_device_are_called_that(tmp_path):
    with pytest.raises(InputFileError, match=r"is a folder\. Choose a file in it\.$"):
        read_text(tmp_path, limit=1)
    with pytest.raises(InputFileError, match=r"is a device or a pipe\. Name a regular file\.$"):
        read_text(Path(os.devnull), limit=1)


def test_of_a_file_that_may_not_be_read_the_permissions_are_to_be_checked(monkeypatch):
    def refuse(path):
        raise PermissionError(13, "Permission denied", path)

    with monkeypatch.context() as denied:
        denied.setattr("os.stat", refuse)  # root may read every file
        with pytest.raises(InputFileError) as said:
            read_text(Path("cat.toml"), limit=1)
    assert str(said.value) == "cat.toml: cannot be read (Permission denied). Check the permissions."


@pytest.mark.parametrize(
    ("written", "there"),
    [
        (r"pictures\cat.png", "pictures/cat.png"),
        (r"C:\Users\me\cat.png", "cat.png"),
        ("/home/me/cat.png", "cat.png"),
    ],
)
def test_of_a_path_of_another_computer_the_file_that_is_there_is_named(written, there, tmp_path):
    (tmp_path / there).parent.mkdir(exist_ok=True)
    (tmp_path / there).touch()
    assert missing_file(written, tmp_path, "mission") == f"{written!r}; write {there!r}"


@pytest.mark.parametrize("text", ["", "-1", "1.0", "²", "٣", " 1", "1_0", "9" * 19, "9" * 5000])
def test_what_is_not_a_whole_number_of_64_bits_is_none(text):
    assert whole_number(text) is None


def test_a_whole_number_is_read():
    assert [whole_number(text) for text in ("0", "007", "9" * 18)] == [0, 7, 10**18 - 1]


def test_the_folder_of_a_user_who_is_not_known_stays_as_it_was_written(monkeypatch):
    monkeypatch.setenv("HOME", "/home/lena")
    assert at_home("~/cat.png") == Path("/home/lena/cat.png")
    for name in ("~nosuchuser/cat.png", "~no\0user/cat.png"):
        assert at_home(name) == Path(name)
