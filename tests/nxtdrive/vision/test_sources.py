"""Sources of frames: images, videos, folders, streams and webcams."""

import errno
from pathlib import Path

import cv2
import numpy as np
import pytest

from firmware_protocol.errors import CameraError
from nxtdrive.vision.camera import EndOfFrames
from nxtdrive.vision.sources import open_camera


def numbered(count, size=(48, 64)):
    """Pictures that differ everywhere."""
    rng = np.random.default_rng(4)
    return [rng.integers(0, 256, (*size, 3), dtype=np.uint8) for _ in range(count)]


def read_all(camera):
    frames = []
    while True:
        try:
            frames.append(camera.read(1.0))
        except EndOfFrames:
            camera.close()
            return frames


@pytest.fixture
def clip(tmp_path):
    """A lossless video of 12 pictures at 20 a second, and the pictures."""
    pictures = numbered(12)
    path = tmp_path / "clip.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"FFV1"), 20.0, (64, 48))
    assert writer.isOpened()
    for picture in pictures:
        writer.write(picture)
    writer.release()
    return path, pictures


def test_an_empty_name_is_not_the_current_folder(clock):
    with pytest.raises(CameraError, match="no camera is named"):
        open_camera("", clock=clock)


@pytest.mark.parametrize("source", ["clip\0.avi", "/dev/video\0", "http://camera\0"])
def test_a_name_with_a_null_character_is_refused(source, clock):
    with pytest.raises(CameraError, match="null character"):
        open_camera(source, clock=clock, open_timeout_s=0.1)


def test_a_video_is_shown_at_its_own_pace(clip, clock):
    path, pictures = clip
    camera = open_camera(str(path), clock=clock)
    assert camera.size == (64, 48)
    frames = read_all(camera)
    assert [frame.time_s for frame in frames] == pytest.approx([i / 20 for i in range(12)])
    for frame, picture in zip(frames, pictures, strict=True):
        np.testing.assert_array_equal(frame.image, picture)


def test_a_video_can_be_read_without_its_pace(clip, clock):
    path, _ = clip
    assert len(read_all(open_camera(str(path), clock=clock, paced=False))) == 12
    assert clock.now() == 0


def test_a_folder_is_shown_in_the_order_of_its_names(tmp_path, clock):
    pictures = numbered(3)
    for number, picture in zip((2, 0, 1), pictures, strict=True):
        cv2.imwrite(str(tmp_path / f"img_{number}.png"), picture)
    (tmp_path / "notes.txt").write_text("not an image")
    frames = read_all(open_camera(str(tmp_path), clock=clock))
    for frame, picture in zip(frames, (pictures[1], pictures[2], pictures[0]), strict=True):
        np.testing.assert_array_equal(frame.image, picture)


def test_one_image_is_shown_forever(tmp_path, clock):
    (picture,) = numbered(1)
    cv2.imwrite(str(tmp_path / "view.PNG"), picture)
    camera = open_camera(str(tmp_path / "view.PNG"), clock=clock)
    frames = [camera.read(1.0) for _ in range(30)]
    np.testing.assert_array_equal(frames[-1].image, picture)
    assert clock.now() == pytest.approx(2.9)


def test_what_is_not_there_is_named(tmp_path, clock):
    with pytest.raises(CameraError, match=r"no camera, file or folder .*lost.avi.*Give a webcam's number"):
        open_camera(str(tmp_path / "lost.avi"), clock=clock)


def test_a_folder_that_may_not_be_read_is_an_error(tmp_path, clock, monkeypatch):
    def denied(path):
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    monkeypatch.setattr(Path, "iterdir", denied)
    with pytest.raises(CameraError, match=r"cannot be read \(Permission denied\)"):
        open_camera(str(tmp_path), clock=clock)


def test_a_folder_without_images_is_refused(tmp_path, clock):
    with pytest.raises(CameraError, match=r"contains no images. Put PNG or JPEG files there"):
        open_camera(str(tmp_path), clock=clock)


@pytest.mark.parametrize(
    ("name", "said"), [("clip.mp4", "is not a video OpenCV can read"), ("view.jpg", "is not an image")]
)
def test_a_file_that_is_not_what_its_name_says_is_refused(tmp_path, clock, name, said):
    (tmp_path / name).write_text("hello")
    with pytest.raises(CameraError, match=f"{name} {said}"):
        open_camera(str(tmp_path / name), clock=clock)


def test_a_broken_image_in_a_folder_is_named(tmp_path, clock):
    cv2.imwrite(str(tmp_path / "a.png"), numbered(1)[0])
    (tmp_path / "b.png").write_bytes(b"\x89PNG")
    camera = open_camera(str(tmp_path), clock=clock)
    camera.read(1.0)
    with pytest.raises(CameraError, match=r"b.png is not an image"):
        camera.read(1.0)
