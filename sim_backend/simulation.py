"""A simulated robot in its world: brick, motors, sensors, floor and camera on one clock.

Time is counted in whole milliseconds and advances only in `Simulation.advance`. The same world, seed and calls give the
same run on any machine and at any speed.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from functools import partial
from itertools import count
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING

from firmware_protocol.enums import SensorType
from sim_backend.devices import TouchSensor, UltrasonicSensor
from sim_backend.devices.failing import failing
from sim_backend.devices.mounting import mount
from sim_backend.firmware.brick import MOTOR_PORTS, SimBrick
from sim_backend.firmware.sensors.i2c_sensor import I2CDevice
from sim_backend.firmware.sensors.input_port import AnalogSensor, InputPort
from sim_backend.webcam import Webcam
from sim_backend.world.loading import load_world
from sim_backend.world.motor import WheelMotor
from sim_backend.world.truth import GroundTruth
from sim_backend.world.world import STEP_MS, World
from sim_backend.world.world_file import WorldFile

if TYPE_CHECKING:
    from sim_backend.camera.textures import Image

DEFAULT_WORLD = "arena"

MV_PER_STEP = 13.848
"""Millivolts per step of the brick's battery converter. Source: docs/firmware.md section 4, GetBatteryLevel."""
SAG_MS, EMPTY_MV = 50, 3000
"""How often the voltage under load is computed, and the lowest one."""


class Simulation:
    """A world with a robot, its brick and its webcam.

    Args:
        world: A world, the path of a world file, or the name of a bundled world.
        seed: Seed of all random draws.
        firmware: Firmware of the brick, "1.29", "1.05" or "1.32".
        camera_size: Width and height of the webcam's frames in pixels.

    Raises:
        ConfigError: The world does not exist, or its file has mistakes.

    Attributes:
        world: The world.
        brick: The simulated brick; connect to it through a `SimLink`.
        webcam: The webcam on the robot.
        truth: Ground truth; for tests and reports only.
        seed: As given.
        generators: Random generators besides the world's that `reseed` seeds.
    """

    def __init__(
        self,
        world: WorldFile | str | Path = DEFAULT_WORLD,
        *,
        seed: int = 0,
        firmware: str = "1.29",
        camera_size: tuple[int, int] = (320, 240),
    ) -> None:
        self.world = World(world if isinstance(world, WorldFile) else load_world(world), seed)
        self.seed = seed
        self.brick = SimBrick(firmware=firmware, seed=seed)
        self.webcam = Webcam(self.world, lambda: self._now_ms, camera_size, seed)
        self.truth = GroundTruth(self.world)
        self.generators: list[Random] = []
        self._now_ms = 0
        self._queue: list[tuple[int, int, Callable[[], None]]] = []
        self._order = count()
        self._sags = bool(self.world.file.robot.battery_ohm or self.world.file.robot.battery_drain_mv_per_min)
        self._plug_in()

    def _plug_in(self) -> None:
        robot = self.world.file.robot
        motors: dict[str, WheelMotor] = {
            robot.left_port: self.world.robot.left,
            robot.right_port: self.world.robot.right,
        }
        self._motors = [motors.get(port) or WheelMotor() for port in MOTOR_PORTS]
        for port, motor in zip(MOTOR_PORTS, self._motors, strict=True):
            self.brick.attach_motor(port, motor)
        if robot.touch_port:
            self._attach(robot.touch_port, TouchSensor(lambda: self.world.robot.bumper_pressed))
        if robot.ultrasonic_port:
            self._attach(robot.ultrasonic_port, UltrasonicSensor(self.world.ultrasonic.distance_cm))
        for table in self.world.file.sensors:
            lamp = partial(_lights_lamp, self.brick.input.ports[table.port - 1])
            self._attach(table.port, mount(table, self.world, lamp))
        self.set_battery(robot.battery_mv)

    def _attach(self, port: int, sensor: AnalogSensor | I2CDevice) -> None:
        """Connect a sensor, which can fail if the world has an event for it."""
        world = self.world
        if any(event.sensor == port for event in world.file.events):
            faults = world.disturbances.faults
            sensor = failing(sensor, lambda: faults.get(port), Random(f"{self.seed}/failing {port}"))
        self.brick.attach_sensor(port, sensor)

    def set_battery(self, battery_mv: int) -> None:
        """Change the battery voltage at rest, which the brick measures and the motors' speed depends on."""
        self._rest_mv = battery_mv
        self._supply(battery_mv)

    def _lower_voltage(self) -> None:
        """Lower the voltage by the charge used and by the current that the motors draw now."""
        robot = self.world.file.robot
        used_mv = robot.battery_drain_mv_per_min * self._now_ms / 60_000
        current_a = sum(motor.current_a for motor in self._motors)
        self._supply(max(EMPTY_MV, round(self._rest_mv - used_mv - 1000 * current_a * robot.battery_ohm)))

    def _supply(self, battery_mv: int) -> None:
        self.brick.set_battery(round(battery_mv / MV_PER_STEP))
        for motor in self._motors:
            motor.set_battery(battery_mv)

    @property
    def now_ms(self) -> int:
        """Simulation time."""
        return self._now_ms

    @property
    def time_s(self) -> float:
        """Simulation time."""
        return self._now_ms / 1000.0

    def motors_turn(self) -> bool:
        """Return whether a motor is to turn; the regulator gives it power up to 100 ms later."""
        controls = [output.control for output in self.brick.output.outputs]
        return any(control.actual_speed or control.target_speed for control in controls)

    def advance(self, duration_ms: int) -> None:
        """Advance the simulation; must not be called from an action or a frame callback.

        Args:
            duration_ms: Whole milliseconds, 0 or more.
        """
        end_ms = self._now_ms + duration_ms
        while True:
            while self._queue and self._queue[0][0] <= self._now_ms:
                heapq.heappop(self._queue)[2]()
            if self._now_ms >= end_ms:
                return
            self._run_until(min(end_ms, self._queue[0][0]) if self._queue else end_ms)

    def _run_until(self, stop_ms: int) -> None:
        world, brick = self.world, self.brick
        now_ms = self._now_ms
        while now_ms < stop_ms:
            step_ms = world.now_ms + STEP_MS
            until_ms = min(stop_ms, step_ms)
            try:
                brick.tick(until_ms - now_ms)
            finally:  # time continues, even if a server survives a defect of the brick
                self._now_ms = until_ms
            now_ms = until_ms
            if now_ms == step_ms:
                world.step()
                if self._sags and now_ms % SAG_MS == 0:
                    self._lower_voltage()
                if now_ms >= self.webcam.next_frame_ms:
                    self.webcam.expose()

    def at(self, due_ms: int, action: Callable[[], None]) -> None:
        """Run `action` at that time, or on the next advance if it is past; in order of the calls if simultaneous."""
        heapq.heappush(self._queue, (due_ms, next(self._order), action))

    def deliver(self, telegram: bytes) -> bytes | None:
        """Deliver a telegram to the brick now; links add timing and order. A brick that is off does not reply."""
        return None if self.brick.powered_off else self.brick.receive(telegram)

    def deliver_bluetooth(self, framed: bytes) -> bytes:
        """Deliver a telegram over Bluetooth; telegram and reply, if any, are preceded by their lengths."""
        return b"" if self.brick.powered_off else self.brick.receive_bluetooth(framed)

    def reseed(self, seed: str) -> None:
        """Reseed all random generators from this moment on; earlier draws stay, and so does the noise of pixels."""
        for number, random in enumerate((*self.world.generators, *self.generators, self.webcam.generator)):
            random.seed(f"{seed}/{number}")

    def unplug(self) -> None:
        """Pull the USB cable now: files opened over it are closed, the motors keep running."""
        self.brick.unplug_usb()

    def camera_frame(self) -> Image | None:
        """Return the webcam's latest frame; see `Webcam.frame`."""
        return self.webcam.frame()

    def on_frame(
        self, callback: Callable[[Image, float], None], fps: float, wanted: Callable[[], bool] = lambda: True
    ) -> None:
        """Call `callback` with the frame and the time in seconds, `fps` times per second of simulation time.

        Frames are skipped while the webcam is unplugged, and while they are not wanted, which saves rendering them.
        """
        start_ms = self._now_ms

        def show(number: int) -> None:
            frame = self.camera_frame() if wanted() else None
            if frame is not None:
                callback(frame, self.time_s)
            self.at(start_ms + round((number + 1) * 1000 / fps), lambda: show(number + 1))

        self.at(start_ms, lambda: show(0))


def _lights_lamp(port: InputPort) -> bool:
    return port.type == SensorType.LIGHT_ACTIVE
