"""The camera's stream: readable by OpenCV and by any other client, none of which the brick waits for."""

import contextlib
import socket
import threading
import urllib.error
import urllib.request
from urllib.parse import urlsplit

import cv2
import numpy as np
import pytest

from firmware_protocol.errors import ConfigError
from sim_backend.doors.mjpeg import STREAM, MjpegDoor

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


def _connect(door):
    """A watcher that has sent its request; it need not read."""
    parts = urlsplit(door.url)
    line = socket.create_connection((parts.hostname, parts.port), timeout=10)
    line.sendall(f"GET {STREAM} HTTP/1.0\r\n\r\n".encode())
    return line


def _until(condition):
    pause = threading.Event()
    for _ in range(2000):
        if condition():
            return True
        pause.wait(0.005)
    return False


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
        assert _until(lambda: door.watched)
        door.show(NOISE)
        stream = line.makefile("rb")
        head = [row.strip() for row in iter(stream.readline, b"\r\n")]
        assert head[0].endswith(b"200 OK")
        assert any(b"multipart/x-mixed-replace" in row for row in head)
        part = dict(row.strip().split(b": ") for row in list(iter(stream.readline, b"\r\n"))[1:])
        jpeg = stream.read(int(part[b"Content-Length"]))
        assert cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR).shape == NOISE.shape


def test_it_knows_whether_it_has_viewers(door):
    assert not door.watched
    with _connect(door):
        assert _until(lambda: door.watched)
    with _showing(door, GRAY):
        assert _until(lambda: not door.watched)


@pytest.mark.slow
def test_a_viewer_that_does_not_read_holds_up_no_other(door):
    with _connect(door):
        assert _until(lambda: door.watched)
        for _ in range(300):
            door.show(NOISE)
        with _showing(door, GRAY):
            capture = cv2.VideoCapture(door.url, cv2.CAP_FFMPEG, LIMITS)
            assert capture.read()[0]
            capture.release()
        door.close()


def test_closing_ends_every_thread():
    before = threading.active_count()
    door = MjpegDoor()
    lines = [_connect(door) for _ in range(3)]
    assert _until(lambda: threading.active_count() == before + 4)
    door.close()
    assert threading.active_count() == before
    for line in lines:
        line.close()


def test_other_addresses_are_not_found(door):
    with pytest.raises(urllib.error.HTTPError, match="404") as caught:
        urllib.request.urlopen(door.url.replace(STREAM, "/etc/passwd"), timeout=10)
    caught.value.close()


def test_it_listens_on_this_computer_only(door):
    assert door.url.startswith("http://127.0.0.1:")


def test_a_port_in_use_is_one_sentence(door):
    with pytest.raises(ConfigError, match="cannot use port"):
        MjpegDoor(urlsplit(door.url).port)
