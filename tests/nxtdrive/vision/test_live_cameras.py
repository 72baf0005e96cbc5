"""Live cameras: a real MJPEG stream from a server in this process, and a webcam with OpenCV's end of it mocked."""

import contextlib
import os
import socket
import subprocess
import sys
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import cv2
import numpy as np
import pytest

from firmware_protocol.errors import CameraError
from nxtdrive.transports.base import WallClock
from nxtdrive.vision.sources import open_camera

SIZE = (160, 120)
SHORT = {"open_timeout_s": 4.0, "stall_timeout_s": 0.4}


class MjpegServer:
    """Sends pictures of growing brightness, and stops sending, but not the connection, when `stalled` is set."""

    def __init__(self):
        self.stalled = threading.Event()
        self.closing = threading.Event()
        outer = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self):
                self.send_response(200)
                self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
                self.end_headers()
                with contextlib.suppress(OSError):
                    outer.stream(self.wfile)

            def log_message(self, *arguments):
                pass

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.daemon_threads = True
        self.thread = threading.Thread(target=self.server.serve_forever, args=(0.01,))
        self.thread.start()
        self.url = f"http://127.0.0.1:{self.server.server_port}/stream.mjpg"

    def stream(self, out):
        level = 0
        while not self.closing.wait(0.01):
            if self.stalled.is_set():
                continue
            level = min(255, level + 1)
            _, jpeg = cv2.imencode(".jpg", np.full((SIZE[1], SIZE[0], 3), level, np.uint8))
            head = f"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n\r\n"
            out.write(head.encode() + jpeg.tobytes() + b"\r\n")

    def close(self):
        self.closing.set()
        self.server.shutdown()
        self.thread.join()
        self.server.server_close()


@pytest.fixture
def server():
    server = MjpegServer()
    yield server
    server.close()


def read_until_error(camera):
    """Frames that were under way when the stream stalled still come."""
    while True:
        camera.read(0.3)


def test_a_stream_gives_ever_newer_frames(server):
    camera = open_camera(server.url, clock=WallClock(), **SHORT)
    try:
        frames = [camera.read(2.0) for _ in range(5)]
    finally:
        camera.close()
    assert camera.size == SIZE
    assert frames[0].image.shape == (120, 160, 3)
    assert sorted({frame.index for frame in frames}) == [frame.index for frame in frames]
    assert sorted(frame.time_s for frame in frames) == [frame.time_s for frame in frames]
    assert frames[-1].image.mean() > frames[0].image.mean()


def test_a_stream_that_stalls_is_reported_and_taken_up_again(server):
    camera = open_camera(server.url, clock=WallClock(), **SHORT)
    try:
        camera.read(2.0)
        server.stalled.set()
        with pytest.raises(CameraError, match=r"gave no frame for 0.3 s. Open the address in a browser"):
            read_until_error(camera)
        server.stalled.clear()
        assert camera.read(10.0).image.shape == (120, 160, 3)
    finally:
        camera.close()


def test_a_stream_that_is_not_there_is_reported():
    with socket.create_server(("127.0.0.1", 0)) as unused:
        port = unused.getsockname()[1]
    with pytest.raises(CameraError, match=r"the stream http.* gives no frames"):
        open_camera(f"http://127.0.0.1:{port}/stream.mjpg", clock=WallClock(), **SHORT)


@pytest.mark.slow
def test_a_server_that_never_answers_is_reported():
    with socket.create_server(("127.0.0.1", 0)) as silent:
        url = f"http://127.0.0.1:{silent.getsockname()[1]}/stream.mjpg"
        with pytest.raises(CameraError, match=r"gives no frames"):
            open_camera(url, clock=WallClock(), open_timeout_s=0.5, stall_timeout_s=0.4)


class Webcam:
    """What `cv2.VideoCapture` does with a webcam; a frame may be held back."""

    def __init__(self, opened=True):
        self.opened = opened
        self.frames = threading.Semaphore(0)
        self.unplugged = False
        self.released = threading.Event()
        self.taken = 0

    def deliver(self, count=1):
        self.frames.release(count)

    def unplug(self):
        self.unplugged = True
        self.frames.release()

    def isOpened(self):
        return self.opened

    def set(self, what, value):
        return True

    def read(self):
        self.frames.acquire()
        if self.unplugged:
            return False, None
        self.taken += 1
        return True, np.full((48, 64, 3), self.taken, np.uint8)

    def release(self):
        self.released.set()


def test_a_webcam_gives_its_freshest_frame_not_the_oldest(mocker):
    webcam = Webcam()
    mocker.patch("cv2.VideoCapture", side_effect=[webcam])
    webcam.deliver(1)
    camera = open_camera("0", clock=WallClock())
    assert camera.read(2.0).index == 0
    webcam.deliver(30)
    while camera.read(2.0).index < 30:
        pass
    with pytest.raises(CameraError, match=r"camera 0 gave no frame for 0 s"):
        camera.read(0)
    webcam.unplug()
    camera.close()
    assert webcam.released.is_set()


@pytest.mark.slow
def test_a_webcam_that_was_pulled_out_comes_back_when_plugged_in(mocker):
    first, second = Webcam(), Webcam()
    mocker.patch("cv2.VideoCapture", side_effect=[first, Webcam(opened=False), second])
    first.deliver(1)
    camera = open_camera("1", clock=WallClock())
    camera.read(2.0)
    first.unplug()
    with pytest.raises(CameraError, match=r"camera 1 gave no frame for 0.1 s. Is it plugged in"):
        camera.read(0.1)
    assert first.released.is_set()
    second.deliver(1)
    assert camera.read(5.0).index == 1
    second.unplug()
    camera.close()


@pytest.fixture
def link():
    """A name in /dev for a webcam, as udev makes in /dev/v4l/by-id, that stays when the webcam's number changes."""
    if not os.path.isdir("/dev/shm"):
        pytest.skip("needs Linux")
    path = Path(f"/dev/shm/nxtdrive-{os.getpid()}")
    yield path
    path.unlink(missing_ok=True)


def test_a_webcam_that_comes_back_with_another_number_is_found_by_its_name(mocker, link):
    mocker.patch("nxtdrive.vision.live.REOPEN_AFTER_S", 0.01)
    link.symlink_to("/dev/video200")
    first, second, opened = Webcam(), Webcam(), []
    mocker.patch(
        "cv2.VideoCapture", side_effect=lambda number: opened.append(number) or (second if opened[1:] else first)
    )
    first.deliver(1)
    camera = open_camera(str(link), clock=WallClock())
    camera.read(2.0)
    link.unlink()
    first.unplug()
    assert first.released.wait(5.0)
    link.symlink_to("/dev/video202")
    second.deliver(1)
    assert camera.read(5.0).index == 1
    second.unplug()
    camera.close()
    assert opened[:2] == [200, 202]


def test_a_webcam_whose_driver_fails_while_it_is_opened_is_reported(mocker):
    mocker.patch("cv2.VideoCapture", side_effect=cv2.error("no device"))
    with pytest.raises(CameraError, match=r"camera 0 gives no frames. Is it plugged in"):
        open_camera("0", clock=WallClock())


def _pull_out_and_reopen(first, second):
    """Open the first webcam, pull it out, and read from the second."""
    first.deliver(1)
    camera = open_camera("0", clock=WallClock())
    camera.read(2.0)
    first.unplug()
    second.deliver(1)
    assert camera.read(5.0).index == 1
    second.unplug()
    camera.close()


def test_a_webcam_that_was_pulled_out_is_reopened_although_its_driver_fails_at_first(mocker):
    mocker.patch("nxtdrive.vision.live.REOPEN_AFTER_S", 0.01)
    first, second = Webcam(), Webcam()
    mocker.patch("cv2.VideoCapture", side_effect=[first, cv2.error("no device"), OSError("busy"), second])
    _pull_out_and_reopen(first, second)


def test_a_webcam_whose_driver_fails_while_it_is_closed_is_reopened(mocker):
    mocker.patch("nxtdrive.vision.live.REOPEN_AFTER_S", 0.01)
    first, second = Webcam(), Webcam()
    mocker.patch("cv2.VideoCapture", side_effect=[first, second])
    mocker.patch.object(first, "release", side_effect=OSError("no such device"))
    _pull_out_and_reopen(first, second)


def test_an_observer_that_fails_is_reported_once_and_the_camera_continues(mocker, caplog):
    webcam, seen = Webcam(), []
    mocker.patch("cv2.VideoCapture", side_effect=[webcam])
    webcam.deliver(1)
    camera = open_camera("0", clock=WallClock())
    camera.read(2.0)

    def fail(frame):
        raise ValueError("the disk is full")

    camera.on_frame(fail)
    camera.on_frame(lambda frame: seen.append(frame.index))
    webcam.deliver(3)
    while camera.read(2.0).index < 3:
        pass
    webcam.unplug()
    camera.close()
    assert seen == [1, 2, 3]
    assert [record.getMessage() for record in caplog.records] == ["an observer of camera 0 failed and is left out"]
    assert webcam.released.is_set()


class OddCamera(Webcam):
    """Delivers one frame of another kind again and again."""

    def __init__(self, frame):
        super().__init__()
        self.frame = frame
        self.deliver(1)

    def read(self):
        super().read()
        if isinstance(self.frame, Exception):
            raise self.frame
        return True, self.frame


@pytest.mark.parametrize(
    ("frame", "shape", "value"),
    [
        (np.full((12, 16), 90, np.uint8), (12, 16, 3), 90),
        (np.full((12, 16, 1), 90, np.uint8), (12, 16, 3), 90),
        (np.full((12, 16), 90 * 257, np.uint16), (12, 16, 3), 90),
        (np.full((12, 16, 4), 90, np.uint8), (12, 16, 3), 90),
        (np.full((60, 80, 3), 90, np.uint8), (30, 40, 3), 90),
    ],
)
def test_frames_of_other_kinds_become_frames_of_the_usual_one(mocker, frame, shape, value):
    mocker.patch("nxtdrive.vision.frames.MAX_PIXELS", 1200)
    mocker.patch("cv2.VideoCapture", side_effect=[odd := OddCamera(frame)])
    camera = open_camera("0", clock=WallClock())
    image = camera.read(2.0).image
    assert (image.dtype, image.shape, image.min(), image.max()) == (np.uint8, shape, value, value)
    odd.unplug()
    camera.close()


@pytest.mark.parametrize(
    "frame", [None, np.zeros((12, 16, 2), np.uint8), cv2.error("damaged"), MemoryError(), OSError("no such device")]
)
def test_a_camera_whose_frames_are_not_pictures_is_reported(mocker, frame):
    mocker.patch("cv2.VideoCapture", side_effect=[OddCamera(frame)])
    with pytest.raises(CameraError, match=r"camera 0 gives no frames"):
        open_camera("0", clock=WallClock())


def test_a_webcam_that_cannot_be_opened_is_reported(mocker):
    mocker.patch("cv2.VideoCapture", side_effect=lambda number: Webcam(opened=False))
    with pytest.raises(CameraError, match=r"camera 3 gives no frames. Is it plugged in"):
        open_camera("3", clock=WallClock())


def test_a_frame_from_before_a_stall_is_not_given(mocker, clock):
    webcam = Webcam()
    mocker.patch("cv2.VideoCapture", side_effect=[webcam])
    webcam.deliver(1)
    camera = open_camera("0", clock=clock)
    clock.sleep(4)  # its driver hangs, and nothing reads the one frame that there is
    with pytest.raises(CameraError, match=r"gave no frame for 0.1 s"):
        camera.read(0.1)
    webcam.deliver(1)
    assert camera.read(2.0).time_s == clock.now()
    webcam.unplug()
    camera.close()


def test_a_webcam_whose_driver_hangs_is_reported(mocker):
    hanging = Webcam()
    mocker.patch("cv2.VideoCapture", side_effect=[hanging])
    mocker.patch("nxtdrive.vision.live.CLOSE_WITHIN_S", 0.01)
    with pytest.raises(CameraError, match=r"camera 0 gives no frames"):
        open_camera("0", clock=WallClock(), open_timeout_s=0.1)
    hanging.unplug()


INTERRUPTED = """
import os, signal, socket, sys, time
from nxtdrive.signals import signals_as_interrupt
from nxtdrive.vision.sources import open_camera
server = socket.create_server(("127.0.0.1", 0))
program = os.getpid()
if not os.fork():
    viewer, _ = server.accept()
    time.sleep(0.3)
    os.kill(program, signal.SIGTERM)
    time.sleep(float(sys.argv[1]))
    viewer.close()
    os._exit(0)
try:
    with signals_as_interrupt():
        open_camera(f"http://127.0.0.1:{server.getsockname()[1]}/camera.mjpg")
except KeyboardInterrupt:
    sys.exit(3)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="forks")
@pytest.mark.parametrize("after_s", [0.0, 0.02, 2.5])
def test_a_program_that_is_interrupted_while_a_camera_opens_ends_in_good_order(after_s):
    """A thread that returns from OpenCV to a Python that ends would abort the process."""
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED, str(after_s)], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 3, done.stderr


ABANDONED = """
import threading, time
from nxtdrive.transports.base import WallClock
from nxtdrive.vision.live import LiveCamera
def open_capture():
    time.sleep(0.3)
    print("returned", flush=True)
    raise SystemExit
start = threading.Thread.start
def interrupted(thread):
    start(thread)
    raise KeyboardInterrupt
threading.Thread.start = interrupted
try:
    LiveCamera("camera 0", "", open_capture, WallClock(), 1.0)
except KeyboardInterrupt:
    pass
"""


@pytest.mark.slow
def test_the_program_waits_for_a_camera_that_was_interrupted_as_its_thread_started():
    done = subprocess.run([sys.executable, "-c", ABANDONED], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "returned\n", "")
