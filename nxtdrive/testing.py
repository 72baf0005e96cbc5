"""A simulated robot in a world that a test arranges; the pytest fixtures of `nxtdrive.pytest_plugin` use it.

::

    with SimWorld("empty") as world, open_brick(world.address) as brick:
        world.put("lena", x_mm=1500).hide("lena", after_s=2, for_s=10)
        my_robot.drive_to_the_picture(brick)
        assert world.truth.distance_mm("lena") < 500
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from itertools import count
from numbers import Integral, Real
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from pydantic import ValidationError

from firmware_protocol.errors import ConfigError
from input_files.pydantic_words import first_mistake
from nxtdrive.transports.sim import MAX_LATENCY_MS, USB_LATENCY_MS, SimTransport, shared
from sim_backend.bundled import picture_names
from sim_backend.firmware.versions import FIRMWARES
from sim_backend.simulation import Simulation
from sim_backend.world.placement import Outline, outline_of_box
from sim_backend.world.world_file import Box, Person, Picture

if TYPE_CHECKING:
    from behaviors.executive import Report
    from behaviors.mission import Mission
    from nxtdrive.brick import Brick
    from sim_backend.firmware.sensors.i2c_sensor import I2CDevice
    from sim_backend.firmware.sensors.input_port import AnalogSensor

EMPTY = "empty"
"""The bundled world without anything in it."""

STILL_MM, STILL_DEG, STILL_EVERY_MS = 5.0, 3.0, 100
"""A robot that moves less than this stands still, which is looked at this often."""

PRESSED_MM = 20.0
"""A box that is put so far into the robot presses its bumper: the physics pushes the robot back."""

_numbers = count(1)


class TimeLimitExceeded(AssertionError):
    """A program still runs at its world's `time_limit_s`."""


class SimWorld:
    """A simulation to arrange and to inspect. As a context manager it has an address.

    Places are in millimetres on the world's map: x to the right, y down; the `empty` world is 4000 x 3000 with the
    robot at (400, 1500), facing right. Objects put without y get the robot's y. Angles are in degrees clockwise, times
    in seconds. Scheduled changes happen while time passes: while the program waits for the brick, sleeps on its clock,
    or the test calls `advance`.

    Args:
        world: The name of a bundled world, or the path of a world file.
        seed: The seed of all randomness.
        firmware: "1.29", "1.05" or "1.32".
        latency_ms: Round trip of the links, 0 to 10000; USB has 2, Bluetooth 30 to 65.
        time_limit_s: A program that still waits for the brick or sleeps on its clock at this simulated time gets a
            `TimeLimitExceeded`, again each second. It ends endless loops, but not those that catch it each time or do
            nothing with the brick; in pytest the marker ``real_time_limit`` ends those too.

    Raises:
        ConfigError: There is no such world or firmware, the world's file has mistakes, or a number is out of range.

    Attributes:
        simulation: The simulation itself.
        truth: Where everything really is; see `sim_backend.world.truth.GroundTruth`.
        address: The brick's address within the block; each opening makes a new link.
        overrun: The first `TimeLimitExceeded` that a program got, which it may have caught; else None.
    """

    def __init__(
        self,
        world: str | Path = EMPTY,
        *,
        seed: int = 0,
        firmware: str = "1.29",
        latency_ms: float = USB_LATENCY_MS,
        time_limit_s: float = math.inf,
    ) -> None:
        seed = _whole("seed", seed)
        if firmware not in FIRMWARES:
            *others, last = map(repr, FIRMWARES)
            raise ConfigError(f"there is no firmware {firmware!r}; it is {', '.join(others)} or {last}, in quotes.")
        self._latency_ms = _number("latency_ms", latency_ms)
        if not 0 <= self._latency_ms <= MAX_LATENCY_MS:
            raise ConfigError(f"latency_ms must be from 0 to {MAX_LATENCY_MS}, not {latency_ms:g}.")
        self.simulation = Simulation(world, seed=seed, firmware=firmware)
        self.truth = self.simulation.truth
        self.address = ""
        self.overrun: TimeLimitExceeded | None = None
        self._links: list[SimTransport] = []
        self._ends = contextlib.ExitStack()
        self._time_limit_s = _number("time_limit_s", time_limit_s)
        if not time_limit_s > 0:
            raise ConfigError(f"time_limit_s must be more than 0, not {time_limit_s:g}.")
        if time_limit_s < math.inf:
            self._stood = self.truth.pose, 0.0
            self._watch_standing()
            self.simulation.at(round(time_limit_s * 1000), self._time_is_up)

    def __enter__(self) -> Self:
        self.address = self._ends.enter_context(shared(f"world{next(_numbers)}", self.open_transport))
        return self

    def __exit__(self, *_: object) -> None:
        self._ends.close()

    def _time_is_up(self) -> None:
        self.simulation.at(self.simulation.now_ms + 1000, self._time_is_up)
        since_s = self._stood[1]
        stands = f" The robot has stood still since {since_s:.1f} s." if self.time_s - since_s > 1 else ""
        error = TimeLimitExceeded(
            f"The program still runs after {self._time_limit_s:g} s of simulated time. Does your loop ever end?{stands}"
        )
        self.overrun = self.overrun or error
        raise error

    def _watch_standing(self) -> None:
        """Keep where and since when the robot stands, as long as time passes."""
        self.simulation.at(self.simulation.now_ms + STILL_EVERY_MS, self._watch_standing)
        (there, _), here = self._stood, self.truth.pose
        moved_mm = math.dist(there[:2], here[:2])
        if moved_mm > STILL_MM or abs(there.heading_deg - here.heading_deg) > STILL_DEG:
            self._stood = here, self.time_s

    @property
    def time_s(self) -> float:
        """Simulated time since the start."""
        return self.simulation.time_s

    @property
    def left_open(self) -> list[SimTransport]:
        """Links that are still open."""
        return [link for link in self._links if not link.closed]

    def open_transport(self) -> SimTransport:
        """Open another link to the brick."""
        links = self._links

        class Link(SimTransport):
            """A link that is tracked, as are its successors after a reconnection."""

            def __init__(self, *arguments: Any, **options: Any) -> None:  # noqa: ANN401 - those of SimTransport
                super().__init__(*arguments, **options)
                links.append(self)

        return Link(self.simulation, latency_ms=self._latency_ms, address=self.address or "sim://")

    def advance(self, duration_s: float) -> None:
        """Let time pass without a program.

        Raises:
            ConfigError: The duration is not a number, or is negative or infinite.
        """
        self.simulation.advance(_duration_ms("duration_s", duration_s))

    def put(
        self,
        name: str,
        *,
        x_mm: float,
        y_mm: float | None = None,
        facing_deg: float | None = None,
        after_s: float = 0.0,
    ) -> Self:
        """Move a picture, box or person of this world to a place, or add one of the built-in pictures.

        Args:
            name: Of the object or picture.
            x_mm: Where.
            y_mm: Where; by default the robot's y at that time.
            facing_deg: Direction of its front; by default pictures face the robot, and boxes keep theirs.
            after_s: When, from now.

        Raises:
            ConfigError: Nothing has this name, or the place is outside the room.
        """
        at_mm = self._inside(x_mm, y_mm)
        if facing_deg is not None:
            _finite("facing_deg", facing_deg)
        if not self._knows(name):
            self._add(Picture, name=name, at_mm=at_mm, facing_deg=0.0, present=False)
        return self._later(after_s, lambda: self._place(name, x_mm, y_mm, facing_deg))

    def put_picture(
        self,
        name: str,
        file: str | Path,
        *,
        x_mm: float,
        y_mm: float | None = None,
        size_mm: tuple[float, float] = (210.0, 297.0),
    ) -> Self:
        """Add a picture file, facing the robot."""
        path = Path(file)
        if not path.is_file():
            raise ConfigError(f"there is no picture {path.name} in {path.absolute().parent}.")
        at_mm = self._inside(x_mm, y_mm)
        self._add(Picture, name=name, file=path.absolute(), at_mm=at_mm, facing_deg=0.0, size_mm=size_mm)
        return self.put(name, x_mm=x_mm, y_mm=y_mm)

    def put_box(
        self,
        name: str,
        *,
        x_mm: float,
        y_mm: float | None = None,
        size_mm: tuple[float, float] = (200.0, 200.0),
        height_mm: float = 300.0,
        facing_deg: float = 0.0,
        mass_kg: float | None = None,
    ) -> Self:
        """Add a box; with a mass the robot can push it, without one it is fixed like a wall.

        Raises:
            ConfigError: The name is taken, a value is out of range, or the place is outside the room or on the robot.
        """
        at_mm = self._inside(x_mm, y_mm)
        return self._add(
            Box, name=name, at_mm=at_mm, size_mm=size_mm, height_mm=height_mm, facing_deg=facing_deg, mass_kg=mass_kg
        )

    def put_person(self, name: str, *, x_mm: float, y_mm: float | None = None) -> Self:
        """Add a standing person, who can `walk`."""
        self._add(Person, name=name, enters_from_mm=self._inside(x_mm, y_mm))
        return self.put(name, x_mm=x_mm, y_mm=y_mm)

    def hide(self, name: str, *, after_s: float = 0.0, for_s: float | None = None) -> Self:
        """Take an object or person away, `after_s` from now, and bring it back to its place `for_s` later.

        Raises:
            ConfigError: Nothing has this name.
        """
        self._check(name)
        if for_s is not None:
            _duration_ms("for_s", for_s)
        world = self.simulation.world
        self._later(after_s, lambda: world.place(name, None, None, present=False))
        if for_s is not None:
            self._later(after_s + for_s, lambda: world.place(name, None, None, present=True))
        return self

    def walk(self, name: str, *, x_mm: float, y_mm: float | None = None, after_s: float = 0.0) -> Self:
        """Have a person walk somewhere, 800 mm a second unless the world says otherwise, and let the robot pass.

        Raises:
            ConfigError: There is no person of this name, or the place is outside the room.
        """
        people = self.simulation.world.people
        if name not in people:
            raise ConfigError(f"there is no person {name!r} here; known: {', '.join(people) or 'none'}.")
        self._inside(x_mm, y_mm)
        return self._later(after_s, lambda: people[name].come((x_mm, self._row_mm(y_mm)), None))

    def place_robot(self, *, x_mm: float, y_mm: float, heading_deg: float = 0.0) -> Self:
        """Lift the robot up and put it down elsewhere."""
        self.simulation.world.place_robot(self._inside(x_mm, y_mm), _finite("heading_deg", heading_deg))
        return self

    def plug(self, port: int, sensor: AnalogSensor | I2CDevice | None) -> Self:
        """Plug a device of `sim_backend.devices` into port 1..4, or unplug what is there with None.

        Raises:
            ConfigError: It is not a device.
        """
        if sensor is not None and (
            isinstance(sensor, type) or not (hasattr(sensor, "raw") or hasattr(sensor, "address"))
        ):
            remedy = "Make one of sim_backend.devices, as in TouchSensor(lambda: True)."
            raise ConfigError(f"{sensor!r} is not a device.", remedy=remedy)
        self.simulation.brick.attach_sensor(port, sensor)
        return self

    def run_mission(self, brick: Brick, mission: Mission | str | Path, *, rendered: bool = False) -> Report:
        """Run a mission on the brick, to its end.

        Args:
            brick: The open brick of this world.
            mission: A mission, or the path of its file.
            rendered: Run the mission's own detectors on rendered frames. By default targets are found by geometry, as
                often as the picture detector finds them and about ten times as fast, if the world has a picture of
                each target's name.

        Raises:
            ConfigError: The file has mistakes, or a picture cannot be used.
        """
        from behaviors.observers import Observers
        from nxtdrive.mission.assembly import MissionRun, OpenRobot
        from nxtdrive.mission.camera import GEOMETRIC, SIMULATED, open_mission_camera
        from nxtdrive.mission.files import read_mission_file

        if isinstance(mission, str | Path):
            mission = read_mission_file(Path(mission))
        source = SIMULATED if rendered else GEOMETRIC
        robot = OpenRobot(brick, open_mission_camera(source, brick), brick.link.transport.address, source)
        return MissionRun(mission, robot, Observers()).pursue()

    def _place(self, name: str, x_mm: float, y_mm: float | None, facing_deg: float | None) -> None:
        world = self.simulation.world
        y_mm = self._row_mm(y_mm)
        if facing_deg is None and name in world.pictures:
            facing_deg = math.degrees(math.atan2(world.robot.y_mm - y_mm, world.robot.x_mm - x_mm))
        world.place(name, (x_mm, y_mm), facing_deg, present=True)

    def _inside(self, x_mm: float, y_mm: float | None) -> tuple[float, float]:
        """Return a place on the floor.

        Raises:
            ConfigError: It is outside the room, or no number.
        """
        x_mm, y_mm = _number("x_mm", x_mm), _number("y_mm", self._row_mm(y_mm))
        width_mm, depth_mm = self.simulation.world.file.floor.size_mm
        if not (0 <= x_mm <= width_mm and 0 <= y_mm <= depth_mm):
            raise ConfigError(f"({x_mm:g}, {y_mm:g}) is outside the floor of {width_mm:g} x {depth_mm:g} mm.")
        return x_mm, y_mm

    def _row_mm(self, y_mm: float | None) -> float:
        return self.simulation.world.robot.y_mm if y_mm is None else y_mm

    def _later(self, after_s: float, action: Callable[[], None]) -> Self:
        if delay_ms := _duration_ms("after_s", after_s):
            self.simulation.at(self.simulation.now_ms + delay_ms, action)
        else:
            action()
        return self

    def _add(self, kind: type[Box | Picture | Person], **values: object) -> Self:
        try:
            table = kind.model_validate(values)
        except ValidationError as error:
            raise ConfigError(f"{first_mistake(error.errors(include_url=False))}.") from None
        if isinstance(table, Picture) and table.file is None:
            self._check_picture(table.name)
        if isinstance(table, Box):
            self._check_clear(outline_of_box(table))
        try:
            self.simulation.world.add(table)
        except ValueError as error:
            raise ConfigError(f"{error}; `put` moves it.") from None
        return self

    def _knows(self, name: str) -> bool:
        world = self.simulation.world
        return name in world.pictures or name in world.boxes or name in world.people

    def _check(self, name: str) -> None:
        if not self._knows(name):
            world = self.simulation.world
            known = ", ".join([*world.pictures, *world.boxes, *world.people]) or "nothing"
            raise ConfigError(f"there is no {name!r} here; known: {known}.")

    def _check_clear(self, box: Outline) -> None:
        robot, needed_mm = self.truth.pose, self.simulation.world.file.robot.radius_mm
        if box.distance_mm(robot[:2]) < needed_mm - PRESSED_MM:
            where = f"at ({robot.x_mm:.0f}, {robot.y_mm:.0f})"
            raise ConfigError(f"{box.what} would stand on the robot, {where}: it needs {needed_mm:g} mm around it.")

    def _check_picture(self, name: str) -> None:
        known = picture_names()
        if name not in known:
            raise ConfigError(
                f"there is no {name!r} in this world, nor among the pictures {', '.join(known)}.",
                remedy="Bring it in with put_box, put_person or put_picture.",
            )


def _number(name: str, value: object) -> float:
    if not isinstance(value, Real):
        raise ConfigError(f"{name} must be a number, not {value!r}.")
    return float(value)


def _whole(name: str, value: object) -> int:
    if not isinstance(value, Integral):
        raise ConfigError(f"{name} must be a whole number, not {value!r}.")
    return int(value)


def _finite(name: str, value: object) -> float:
    if not math.isfinite(number := _number(name, value)):
        raise ConfigError(f"{name} must be finite, not {number:g}.")
    return number


def _duration_ms(name: str, value: object) -> int:
    if not 0 <= (duration_s := _number(name, value)) < math.inf:
        raise ConfigError(f"{name} must be 0 or more and finite, not {duration_s:g}.")
    return round(duration_s * 1000)
