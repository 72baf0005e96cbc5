"""Files that are written as a whole or not at all."""

import os

import pytest

from nxtdrive.recording.output_file import draft, replace_file
from tests.open_files import files_left


def test_a_draft_takes_the_place_of_a_file_and_keeps_its_permissions(tmp_path):
    path = tmp_path / "robot.toml"
    path.write_text("old")
    path.chmod(0o600)
    with draft(path, b"new") as beside:
        assert path.read_text() == "old"
        beside.replace(path)
    assert (path.read_text(), path.stat().st_mode & 0o777) == ("new", 0o600)
    assert list(tmp_path.iterdir()) == [path]


def test_a_draft_that_is_not_used_is_removed(tmp_path):
    with pytest.raises(ValueError, match="not good"), draft(tmp_path / "robot.toml", b"new"):
        raise ValueError("not good")
    assert list(tmp_path.iterdir()) == []


def test_a_link_to_a_file_that_is_replaced_stays(tmp_path):
    path, link = tmp_path / "robot.toml", tmp_path / "link.toml"
    path.write_text("old")
    link.symlink_to(path)
    replace_file(link, b"new")
    assert link.is_symlink()
    assert path.read_text() == "new"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes in the file system")
def test_what_is_no_regular_file_is_not_replaced(tmp_path):
    pipe, link = tmp_path / "pipe", tmp_path / "link"
    os.mkfifo(pipe)
    link.symlink_to(pipe)
    for path in (pipe, link):
        with pytest.raises(OSError, match="not a regular file"):
            replace_file(path, b"new")
    assert pipe.is_fifo()
    assert sorted(tmp_path.iterdir()) == [link, pipe]


def test_a_file_that_cannot_be_replaced_is_left_as_it_is(tmp_path):
    path = tmp_path / "robot.toml"
    path.write_text("old")
    with files_left(0), pytest.raises(OSError, match="Too many open files"):
        replace_file(path, b"new")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
