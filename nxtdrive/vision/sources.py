"""Open any source of frames: a webcam's number, a stream's URL, a video, a folder of images, one image."""

from __future__ import annotations

import os
import re
import stat
import sys
from collections.abc import Callable, Iterator
from itertools import repeat
from pathlib import Path

import cv2

from behaviors.ports import Clock
from firmware_protocol.errors import CameraError
from input_files.picture import read_picture
from input_files.plain import IMAGE_SUFFIXES, InputFileError, at_home, refuse_empty, whole_number
from nxtdrive.host.access import device_remedy, is_denied
from nxtdrive.transports import open_transport
from nxtdrive.transports.base import WallClock
from nxtdrive.transports.record import recorded
from nxtdrive.vision.camera import Camera, FrameSource, ReplayCamera, SimulatedCamera
from nxtdrive.vision.detection import Image
from nxtdrive.vision.frames import as_frame
from nxtdrive.vision.live import LiveCamera
from nxtdrive.vision.opencv import configure, opencv_name

FOLDER_FPS = 10.0
FALLBACK_FPS = 25.0
DEVICES = Path("/dev")
LAST_WEBCAM = 255
"""Linux has 256 minor numbers for ``/dev/video``."""
WEBCAM_SIZE = (640, 480)


def open_camera(
    source: str,
    *,
    clock: Clock | None = None,
    open_timeout_s: float = 8.0,
    stall_timeout_s: float = 3.0,
    paced: bool = True,
) -> Camera:
    """Open a camera.

    Args:
        source: ``"0"`` (a webcam's number), ``"http://..."`` or ``"rtsp://..."`` (a stream), or the path of a video, of
            a folder with images (shown in the order of their names) or of one image (shown forever). ``"sim"`` is the
            camera of the simulated robot whose brick is the clock, or without one, of a robot in the bundled world.
        clock: The mission's time, such as a brick; by default the wall clock.
        open_timeout_s: Longest wait for a live camera's first frame.
        stall_timeout_s: A stream without data for this long is opened again.
        paced: Show recordings at their own pace; otherwise one frame per read, without waiting.

    Raises:
        CameraError: The camera cannot be opened; the message says why and what to do.
    """
    configure()
    if not source:
        raise CameraError("no camera is named.", remedy="Give a webcam's number (0), a file, a folder or a URL.")
    if "\0" in source:
        raise CameraError(f"the camera's name {source!r} has a null character.", remedy="Leave it out.")
    if source == "sim":
        return _open_simulated(clock)
    clock = clock or WallClock()
    if (number := _webcam_number(source)) is not None:
        return LiveCamera(
            f"camera {number}",
            _webcam_remedy(number),
            lambda: _open_webcam(source),
            clock,
            open_timeout_s,
        )
    if re.match(r"[a-z][a-z0-9+.-]+://", source, re.IGNORECASE):
        opencv_name(source, CameraError)
        return LiveCamera(
            f"the stream {source}",
            "Open the address in a browser or in VLC to see whether it runs.",
            _stream_opener(source, open_timeout_s, stall_timeout_s),
            clock,
            open_timeout_s,
        )
    return _open_recording(at_home(source), clock, paced)


def _open_simulated(clock: Clock | None) -> Camera:
    """Open the camera of a simulated robot, whose transport has its frames."""
    if clock is None:
        own = open_transport("sim://")
        return simulated_camera(getattr(own, "webcam", None), own, own.address)
    link = getattr(clock, "link", None)  # a brick has one
    transport = recorded(link.transport) if link else None
    return simulated_camera(getattr(transport, "webcam", None), clock, getattr(transport, "address", "this clock"))


def simulated_camera(frames: FrameSource | None, clock: Clock, address: str) -> SimulatedCamera:
    """Return the camera of a simulated robot.

    Raises:
        CameraError: There are no frames: the robot at this address is not simulated.
    """
    if frames is None:
        raise CameraError(
            f"{address} has no simulated camera.",
            remedy="Choose a camera: --camera 0 is the first webcam; `nxtdrive sim serve` prints its camera's URL.",
        )
    return SimulatedCamera(frames, clock)


def read_image(path: Path) -> Image:
    """Read an image file as BGR; a very large one is reduced, see `input_files.picture`.

    Raises:
        CameraError: The file is missing, not an image, or too large.
    """
    configure()
    try:
        return read_picture(path)
    except InputFileError as error:
        raise CameraError(str(error)) from None


def _webcam_number(source: str) -> int | None:
    """Return the number of a webcam, given by its number or as ``/dev/video0``; None for other sources.

    Raises:
        CameraError: The webcam is there, but this user may not open it, or no webcam can have this number.
    """
    node = re.fullmatch(r"/dev/video(\d+)", os.path.realpath(source) if source.startswith("/dev/") else "")
    number = whole_number(node[1] if node else source)
    if number is None:
        return None
    if number > LAST_WEBCAM:
        raise CameraError(f"there is no camera {number}.", remedy="Cameras are numbered 0, 1, 2...")
    device = f"/dev/video{number}"
    if is_denied(device):
        raise CameraError(f"this user may not open {device}.", remedy=device_remedy(device, "video"))
    return number


def _webcam_remedy(number: int) -> str:
    """Return what to do when a webcam gives nothing; on Linux the webcams that are there are known."""
    present = sorted(int(device.name[5:]) for device in DEVICES.glob("video*") if device.name[5:].isdecimal())
    if number in present or not sys.platform.startswith("linux"):
        return "Is it plugged in, and does no other program use it? Cameras are numbered 0, 1, 2..."
    if not present:
        return "Is it plugged in? This computer has no camera; a virtual machine or container must be given one."
    there = ", ".join(map(str, present))
    return f"Is it plugged in? There are {there}; of the two numbers of a webcam one gives no frames."


def _open_webcam(source: str) -> cv2.VideoCapture:
    """Open without timeouts: OpenCV's webcam backends reject them; the camera's thread limits the wait instead.

    A name such as one in ``/dev/v4l/by-id`` is looked up each time: a webcam that comes back may have another number.

    Raises:
        CameraError: The name leads to no webcam while it is pulled out.
    """
    if (number := _webcam_number(source)) is None:
        raise CameraError(f"there is no camera {source}.")
    capture = cv2.VideoCapture(number)
    capture.set(cv2.CAP_PROP_FRAME_WIDTH, WEBCAM_SIZE[0])
    capture.set(cv2.CAP_PROP_FRAME_HEIGHT, WEBCAM_SIZE[1])
    capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
    return capture


def _stream_opener(url: str, open_timeout_s: float, stall_timeout_s: float) -> Callable[[], cv2.VideoCapture]:
    limits = [
        cv2.CAP_PROP_OPEN_TIMEOUT_MSEC,
        round(open_timeout_s * 1000),
        cv2.CAP_PROP_READ_TIMEOUT_MSEC,
        round(stall_timeout_s * 1000),
    ]
    return lambda: cv2.VideoCapture(url, cv2.CAP_FFMPEG, limits)


def _open_recording(path: Path, clock: Clock, paced: bool) -> Camera:
    if os.path.isdir(path):
        try:
            files = sorted(file for file in path.iterdir() if file.suffix.lower() in IMAGE_SUFFIXES)
        except OSError as error:
            remedy = "Change its permissions, or name another one."
            raise CameraError(f"the folder {path} cannot be read ({error.strerror}).", remedy=remedy) from None
        if not files:
            raise CameraError(f"the folder {path} contains no images.", remedy="Put PNG or JPEG files there.")
        return ReplayCamera(f"the folder {path}", map(read_image, files), FOLDER_FPS if paced else None, clock)
    try:
        found = os.stat(path)
    except OSError as error:
        raise CameraError(
            f"there is no camera, file or folder {str(path)!r} ({error.strerror}).",
            remedy="Give a webcam's number (0), a video, an image, a folder of images or a URL.",
        ) from None
    if not stat.S_ISREG(found.st_mode):
        raise CameraError(f"{path} is a device or a pipe.", remedy="Name a regular file.")
    try:
        refuse_empty(path, found.st_size)
    except InputFileError as error:
        raise CameraError(str(error)) from None
    if path.suffix.lower() in IMAGE_SUFFIXES:
        return ReplayCamera(f"the image {path}", repeat(read_image(path)), FOLDER_FPS if paced else None, clock)
    return _open_video(path, clock, paced)


def _open_video(path: Path, clock: Clock, paced: bool) -> Camera:
    capture = cv2.VideoCapture(
        opencv_name(path, CameraError),
        cv2.CAP_FFMPEG,
        [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, 5000, cv2.CAP_PROP_READ_TIMEOUT_MSEC, 5000],
    )
    if not capture.isOpened():
        raise CameraError(
            f"{path} is not a video OpenCV can read.", remedy="Use AVI, MP4 or MKV, or a folder of images."
        )
    fps = capture.get(cv2.CAP_PROP_FPS)
    fps = fps if 0 < fps <= 1000 else FALLBACK_FPS
    return ReplayCamera(f"the video {path}", _frames(capture), fps if paced else None, clock, capture.release)


def _frames(capture: cv2.VideoCapture) -> Iterator[Image]:
    while True:
        there, read = capture.read()
        if not there or (image := as_frame(read)) is None:
            return
        yield image
