"""A camera that hangs and repeats its last frame, and cameras that only look like it."""

import numpy as np
import pytest

from behaviors.ports import Pose
from nxtdrive.vision.camera import Frame, ReplayCamera
from nxtdrive.vision.frozen import FrozenFrames
from nxtdrive.vision.geometry import Pinhole
from nxtdrive.vision.target_vision import CameraVision, NoFrame

FPS = 10


class Robot:
    """A robot whose camera takes a frame every 0.1 s, and which drives at a speed; a sensor has noise of this size."""

    def __init__(self, *, noise=4.0, latency_s=0.0):
        self.pose = Pose()
        self.frozen = FrozenFrames(lambda: self.pose, latency_s)
        self._noise, self._rng, self._index = noise, np.random.default_rng(3), 0
        self._scene = np.full((480, 640, 3), 128.0)

    def live(self):
        return np.clip(self._rng.normal(self._scene, self._noise), 0, 255).astype(np.uint8)

    def see(self, image, mm_per_frame=0.0, deg_per_frame=0.0):
        """Take the next frame; return whether the camera seems to hang."""
        self._index += 1
        self.pose = Pose(self.pose.x_mm + mm_per_frame, 0.0, self.pose.heading_deg + deg_per_frame)
        return self.frozen.repeats(Frame(image, self._index / FPS, self._index))


@pytest.mark.parametrize("step", [{"mm_per_frame": 10.0}, {"mm_per_frame": -10.0}, {"deg_per_frame": 4.0}])
def test_a_camera_that_repeats_its_frame_on_the_way_hangs_until_a_frame_differs(step):
    robot = Robot()
    assert not any(robot.see(robot.live(), **step) for _ in range(20))
    last = robot.live()
    found = [robot.see(last.copy(), **step) for _ in range(12)]
    assert not any(found[:5])
    assert all(found[9:])
    assert robot.see(last.copy()), "it still does while the robot waits"
    assert not robot.see(robot.live())


def test_single_repeated_frames_are_usual():
    robot = Robot()
    for _ in range(10):
        image = robot.live()
        assert not any(robot.see(image.copy(), 10.0) for _ in range(3))


def test_frames_of_a_robot_at_rest_may_be_the_same():
    robot = Robot(noise=0.0)
    assert not any(robot.see(robot.live(), 0.01) for _ in range(100))


def test_frames_that_differ_anywhere_are_new():
    robot = Robot(noise=0.0)
    for number in range(100):
        image = robot.live()
        image[1, 1 + number % 600] += 1 + number % 100
        assert not robot.see(image, 10.0)


def test_frames_of_a_late_camera_show_a_motion_later():
    robot = Robot(noise=0.0, latency_s=1.0)
    before = robot.live()
    robot.see(before)
    assert not any(robot.see(before, 20.0) for _ in range(10))


def test_a_recording_never_hangs(clock):
    poses = iter(Pose(100.0 * number) for number in range(100))
    image = np.full((240, 320, 3), 128, np.uint8)
    vision = CameraVision(ReplayCamera("test", iter([image] * 50), FPS, clock), {}, Pinhole.from_hfov(320, 60))
    vision.watch_motion(lambda: next(poses))
    for _ in range(30):
        vision.glance(())


def test_a_live_camera_that_hangs_gives_no_frame(clock):
    class Hanging(Robot):
        size = (640, 480)

        def read(self, timeout_s):
            clock.sleep(1 / FPS)
            self.pose = Pose(10.0 * clock.now() * FPS)
            return Frame(last, clock.now(), round(clock.now() * FPS))

    camera = Hanging()
    last = camera.live()
    vision = CameraVision(camera, {}, Pinhole.from_hfov(640, 60))
    vision.watch_motion(lambda: camera.pose)

    def look_on():
        for _ in range(20):
            vision.glance(())

    with pytest.raises(NoFrame, match="Pull its plug out and put it in again"):
        look_on()
    assert clock.now() < 1.5
