"""Cameras that run on a given clock: simulated ones and recordings."""

import numpy as np
import pytest

from firmware_protocol.errors import CameraError
from nxtdrive.vision.camera import EndOfFrames, ReplayCamera, SimulatedCamera, next_tick


def image(level, size=(4, 6)):
    return np.full((*size, 3), level, np.uint8)


class MillisecondClock:
    """Counts whole milliseconds, as the simulation does; a sleep is rounded down."""

    def __init__(self):
        self.time_ms = 0

    def now(self):
        return self.time_ms / 1000

    def sleep(self, duration_s):
        self.time_ms += int(duration_s * 1000 + 1e-6)


class CountingSource:
    """Shows the number of the frame as its brightness."""

    size = (320, 240)
    detector_s = 0.0

    def __init__(self, clock, fps, unplugged=()):
        self.clock = clock
        self.fps = fps
        self.unplugged = unplugged

    def frame(self):
        number = int(self.clock.now() * self.fps + 1e-6)
        return None if number in self.unplugged else image(number, (240, 320))


@pytest.mark.parametrize("fps", [7, 10, 15, 30])
def test_simulated_camera_gives_each_frame_once_in_its_time(fps):
    clock = MillisecondClock()
    camera = SimulatedCamera(CountingSource(clock, fps), clock)
    frames = [camera.read(1.0) for _ in range(3 * fps)]
    assert [frame.index for frame in frames] == list(range(3 * fps))
    assert [int(frame.image[0, 0, 0]) for frame in frames] == list(range(3 * fps))
    assert [frame.time_s for frame in frames] == pytest.approx([i / fps for i in range(3 * fps)])
    assert clock.now() == pytest.approx((3 * fps - 1) / fps, abs=0.001)


def test_simulated_camera_gives_the_freshest_frame_after_a_pause():
    clock = MillisecondClock()
    camera = SimulatedCamera(CountingSource(clock, 10), clock)
    camera.read(1.0)
    clock.sleep(0.55)
    assert camera.read(1.0).index == 5
    assert clock.now() == 0.55
    assert camera.read(1.0).index == 6
    assert camera.size == (320, 240)


def test_simulated_camera_waits_out_a_short_loss_and_reports_a_long_one():
    clock = MillisecondClock()
    camera = SimulatedCamera(CountingSource(clock, 10, unplugged=range(2, 8)), clock)
    assert [camera.read(0.5).index for _ in range(2)] == [0, 1]
    with pytest.raises(CameraError, match=r"no frame for 0.3 s. Has an event unplugged it, or is drop_rate high"):
        camera.read(0.3)
    assert clock.now() == pytest.approx(0.4)
    assert camera.read(0.5).index == 8


@pytest.mark.parametrize("fps", [1, 7, 15, 29.97, 60])
def test_ticks_are_ahead_by_at_most_a_period(fps):
    for now_ms in range(0, 2000, 7):
        ahead_s = next_tick(now_ms / 1000, fps) - now_ms / 1000
        assert 0 < ahead_s <= 1 / fps + 0.001


def test_replay_keeps_its_pace(clock):
    camera = ReplayCamera("clip", iter([image(i) for i in range(5)]), 10, clock)
    frames = [camera.read(1.0) for _ in range(5)]
    assert [frame.time_s for frame in frames] == pytest.approx([0, 0.1, 0.2, 0.3, 0.4])
    assert [frame.image[0, 0, 0] for frame in frames] == [0, 1, 2, 3, 4]
    assert camera.size == (6, 4)


def test_replay_skips_frames_not_requested_in_time(clock):
    camera = ReplayCamera("clip", iter([image(i) for i in range(50)]), 10, clock)
    camera.read(1.0)
    clock.sleep(1.25)
    frame = camera.read(1.0)
    assert (frame.index, frame.image[0, 0, 0]) == (12, 12)
    assert clock.now() == 1.25


def test_replay_without_pace_gives_every_picture_at_once(clock):
    camera = ReplayCamera("clip", iter([image(i) for i in range(3)]), None, clock)
    assert [camera.read(0).image[0, 0, 0] for _ in range(3)] == [0, 1, 2]
    assert clock.now() == 0


def test_replay_says_when_it_is_over(clock):
    camera = ReplayCamera("the video clip.avi", iter([image(0)]), 10, clock)
    camera.read(1.0)
    with pytest.raises(EndOfFrames, match=r"clip.avi is at its end"):
        camera.read(1.0)


def test_replay_does_not_wait_longer_than_it_may(clock):
    camera = ReplayCamera("slides", iter([image(0), image(1)]), 0.5, clock)
    camera.read(1.0)
    with pytest.raises(CameraError, match=r"no new picture within 0.5 s"):
        camera.read(0.5)
    assert clock.now() == 0.5
    assert camera.read(5.0).index == 1


def test_replay_of_nothing_is_refused(clock):
    with pytest.raises(CameraError, match=r"clip contains no pictures"):
        ReplayCamera("clip", iter([]), 10, clock)
