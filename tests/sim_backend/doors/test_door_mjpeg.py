"""The camera's stream: readable by OpenCV and by any other client, none of which the brick waits for."""

import contextlib
import socket
import threading
import urllib.error
import urllib.request
from functools import partial
from urllib.parse import urlsplit

import cv2
import numpy as np
import pytest

from firmware_protocol.errors import ConfigError
from sim_backend.doors import mjpeg
from sim_backend.doors.door import wait_readable
from sim_backend.doors.mjpeg import STREAM, VIEWER_LIMIT, WAITING_LIMIT, MjpegDoor
from sim_backend.doors.uvc import UvcDoor
from tests.open_files import files_left
from tests.waiting import until

LIMITS = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, 10_000, cv2.CAP_PROP_READ_TIMEOUT_MSEC, 10_000]
GRAY = np.full((120, 160, 3), 90, np.uint8)
NOISE = np.random.default_rng(0).integers(0, 256, (480, 640, 3), np.uint8)


@pytest.fixture
def door():
    door = MjpegDoor()
    yield door
    door.close()


@contextlib.contextmanager
def _showing(door, image):
    """The image again and again, as a camera delivers it."""
    stop = threading.Event()

    def show():
        while not stop.wait(0.01):
            door.show(image)

    thread = threading.Thread(target=show)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def _dial(door):
    """A connection that has sent nothing."""
    parts = urlsplit(door.url)
    return socket.create_connection((parts.hostname, parts.port), timeout=10)


def _drip(line, data):
    """Send byte by byte until the other end answers; the number of bytes sent."""
    for sent, byte in enumerate(data):
        line.sendall(bytes((byte,)))
        if wait_readable([line.fileno()], 0.002):
            return sent
    return len(data)


def _connect(door):
    """A watcher that has sent its request; it need not read."""
    line = _dial(door)
    line.sendall(f"GET {STREAM} HTTP/1.0\r\n\r\n".encode())
    return line


def test_opencv_reads_the_stream(door):
    with _showing(door, GRAY):
        capture = cv2.VideoCapture(door.url, cv2.CAP_FFMPEG, LIMITS)
        assert capture.isOpened()
        for _ in range(5):
            there, image = capture.read()
            assert there
            assert image.shape == GRAY.shape
            assert np.abs(image.astype(int) - 90).max() < 5
        capture.release()


def test_a_watcher_sees_the_freshest_picture_only(door):
    door.show(GRAY)
    with _connect(door) as line:
        until(lambda: door.watched)
        door.show(NOISE)
        stream = line.makefile("rb")
        head = [row.strip() for row in iter(stream.readline, b"\r\n")]
        assert head[0].endswith(b"200 OK")
        assert any(b"multipart/x-mixed-replace" in row for row in head)
        part = dict(row.strip().split(b": ") for row in list(iter(stream.readline, b"\r\n"))[1:])
        jpeg = stream.read(int(part[b"Content-Length"]))
        assert cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR).shape == NOISE.shape


def test_the_door_is_watched_while_a_viewer_is_connected(door):
    assert not door.watched
    with _connect(door):
        until(lambda: door.watched)
    with _showing(door, GRAY):
        until(lambda: not door.watched)


@pytest.mark.slow
def test_a_viewer_that_does_not_read_holds_up_no_other(door):
    with _connect(door):
        until(lambda: door.watched)
        for _ in range(300):
            door.show(NOISE)
        with _showing(door, GRAY):
            capture = cv2.VideoCapture(door.url, cv2.CAP_FFMPEG, LIMITS)
            assert capture.read()[0]
            capture.release()
        door.close()


def test_closing_ends_the_thread_and_every_connection():
    before = set(threading.enumerate())
    door = MjpegDoor()
    lines = [_connect(door) for _ in range(3)]
    until(lambda: door.watched)
    door.close()
    door.close()
    assert set(threading.enumerate()) <= before
    for line in lines:
        with line, contextlib.suppress(ConnectionError):
            while line.recv(4096):
                pass


@pytest.mark.parametrize(
    "sent", [b"", b"G", b"GET /camera.mjpg HTTP/1.1\r\nHost: a\r\n"], ids=["silent", "slow", "halfway"]
)
def test_closing_does_not_wait_for_a_request(sent):
    door = MjpegDoor()
    with _dial(door) as line:
        line.sendall(sent)
        door.close()
        with contextlib.suppress(ConnectionError):
            assert line.recv(100) == b""


def test_closing_does_not_wait_for_a_viewer_that_does_not_read():
    door = MjpegDoor()
    with _connect(door):
        until(lambda: door.watched)
        for _ in range(30):
            door.show(NOISE)
        door.close()


def test_a_request_has_a_deadline_as_a_whole(monkeypatch):
    monkeypatch.setattr(mjpeg, "REQUEST_S", 0.1)
    door = MjpegDoor()
    with contextlib.closing(door), _dial(door) as line:
        dripped = _drip(line, b"GET /camera.mjpg HTTP/1.1\r\n" + b"X: y\r\n" * 1000)
        answer = line.recv(4096)
        assert answer.startswith(b"HTTP/1.0 408 ")
        assert dripped < 1000


def test_a_viewer_above_the_limit_gets_a_reply_and_is_logged_once(door, caplog):
    with contextlib.ExitStack() as stack:
        for line in [stack.enter_context(_connect(door)) for _ in range(VIEWER_LIMIT)]:
            assert line.recv(4096).startswith(b"HTTP/1.0 200 ")
        for _ in range(3):
            with _connect(door) as line:
                assert line.recv(4096).startswith(b"HTTP/1.0 503 ")
        assert caplog.text.count("is refused") == 1
    with _showing(door, GRAY):
        until(lambda: not door.watched)
    with _connect(door):
        until(lambda: door.watched)


def test_connections_without_a_request_keep_no_viewer_out(door):
    with contextlib.ExitStack() as stack:
        lines = [stack.enter_context(_dial(door)) for _ in range(WAITING_LIMIT + 10)]
        stack.enter_context(_connect(door))
        until(lambda: door.watched)
        with contextlib.suppress(ConnectionError):
            assert lines[0].recv(100) == b"", "the oldest were closed"


@pytest.mark.parametrize(
    ("request_", "status"),
    [
        (b"hello\r\n\r\n", 400),
        (b"\x00\xff\x1b\r\n\r\n", 400),
        (b"POST /camera.mjpg HTTP/1.1\r\n\r\n", 405),
        (b"GET /camera.mjpg HTTP/1.1\r\n" + b"X" * 10_000 + b"\r\n\r\n", 431),
    ],
)
def test_anything_that_is_not_a_request_is_refused(door, request_, status):
    with _dial(door) as line:
        line.sendall(request_)
        assert line.recv(4096).startswith(b"HTTP/1.0 %d " % status)


def test_other_addresses_are_not_found(door):
    with pytest.raises(urllib.error.HTTPError, match="404") as caught:
        urllib.request.urlopen(door.url.replace(STREAM, "/etc/passwd"), timeout=10)
    caught.value.close()


def test_it_listens_on_this_computer_only(door):
    assert door.url.startswith("http://127.0.0.1:")


def test_a_port_in_use_is_one_sentence(door):
    with pytest.raises(ConfigError, match="cannot listen on"):
        MjpegDoor(urlsplit(door.url).port)


# asyncio's own: the finaliser of an event loop that could not be made
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("make", [MjpegDoor, partial(UvcDoor, (320, 240), 15.0)])
def test_a_camera_that_gets_no_file_descriptors_is_an_error(make):
    # one for the listener, none for its event loop
    with files_left(1), pytest.raises(ConfigError, match="Too many open files"):
        make()
