"""Measure motion: how exactly motors and robot stop where they should, and how far they go when the link is cut.

Without an address everything is measured in the simulator, whose motors follow the firmware's regulation and have
inertia, at the latencies of a cable and of a radio. With the address of a real brick, a free motor on port A is
measured, without the figures that need the true position. See docs/motion.md.
"""

from __future__ import annotations

import math
import random
import statistics
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from firmware_protocol.direct import GetOutputState
from firmware_protocol.enums import OutputPort
from nxtdrive.brick import Brick, open_brick
from nxtdrive.motion.motor import FASTEST_DEG_S, Then
from nxtdrive.motion.rover import Rover, SafetyLimits
from nxtdrive.transports.sim import SimTransport
from sim_backend.simulation import Simulation
from sim_backend.world.world_file import Floor, Robot, Slip, WorldFile

from .bench import Figure, at_most

if TYPE_CHECKING:
    from nxtdrive.motion.motor import Motor

LATENCIES_MS = (2, 45)
"""Round-trip times of a cable and of a slow radio link."""
POWERS = (40, 75, 100)
"""Percent; as speeds, of the fastest a motor can be asked for."""
SHORTEST_DEG, LONGEST_DEG = 90, 720
REST_S = 1.5
"""After this time every motor has come to rest."""
MISMATCH_PERCENT = 5.0
FREE = SafetyLimits(enabled=False)


@dataclass(frozen=True, slots=True)
class LinkCut:
    """The motion after a link was cut.

    Attributes:
        distance: Degrees of a motor, or millimetres of the robot, until it came to rest.
        time_s: Time until it came to rest; NaN where that cannot be observed.
    """

    distance: float
    time_s: float


def measure_motion(address: str | None = None) -> Iterable[Figure]:
    """Yield every figure of motion.

    Args:
        address: A real brick with a free motor on port A; None for the simulator.
    """
    if address is not None:
        yield from _of_a_real_brick(address)
        return
    for latency_ms in LATENCIES_MS:
        yield from error_figures(f"run_angle, {latency_ms} ms", angle_errors(latency_ms), 2.0, 5.0)
    for latency_ms in LATENCIES_MS:
        turns, drifts = heading_errors(latency_ms)
        _, slipping = heading_errors(latency_ms, slip_percent=1.0)
        yield from error_figures(f"rover.turn, {latency_ms} ms", turns, 2.0, 5.0)
        worst = max(map(abs, drifts))
        name = f"rover.straight, {latency_ms} ms, wheels differ by {MISMATCH_PERCENT:g} %: largest drift"
        yield Figure(name, worst, "deg/m", "<= 1", worst <= 1.0)
        yield Figure(f"the same, and slip at random by 1 %, {latency_ms} ms", max(map(abs, slipping)), "deg/m")
    for latency_ms in LATENCIES_MS:
        for power in POWERS:
            yield from _cuts(
                f"dc({power}), {latency_ms} ms", "deg", [cut_motor(latency_ms, power, n) for n in range(9)]
            )
        for speed_mm_s in (100, 200, 300):
            cuts = [cut_rover(latency_ms, speed_mm_s, n) for n in range(9)]
            yield from _cuts(f"drive({speed_mm_s} mm/s), {latency_ms} ms", "mm", cuts)


def angle_errors(latency_ms: float, number: int = 30) -> list[float]:
    """Return the motor's errors after moves of 90..720 degrees in both directions at 40..100 %; true degrees."""
    errors = []
    for seed in range(number):
        simulation = _simulation(seed)
        with Brick(SimTransport(simulation, latency_ms=latency_ms)) as brick:
            errors.append(_angle_error(brick, POWERS[seed % 3], random.Random(seed)))  # noqa: S311 - repeatable
    return errors


def heading_errors(latency_ms: float, number: int = 12, slip_percent: float = 0.0) -> tuple[list[float], list[float]]:
    """Return the errors of turns, degrees, and of straights, degrees per metre, by the robot's true heading.

    Args:
        latency_ms: Round-trip time of the link.
        number: Number of turns, and of straights.
        slip_percent: Random slip of the wheels in every 10 ms, which odometry cannot measure.
    """
    turns, drifts = [], []
    for seed in range(number):
        simulation = _simulation(seed, slip_percent)
        draw = random.Random(seed)  # noqa: S311 - repeatable
        with Brick(SimTransport(simulation, latency_ms=latency_ms)) as brick:
            rover = Rover(brick.link, safety=FREE)
            turn_deg, distance_mm = draw.choice((-1, 1)) * draw.uniform(15, 360), draw.uniform(500, 2000)
            heading_deg = simulation.truth.pose.heading_deg
            rover.straight(distance_mm)
            brick.sleep(REST_S)
            drifts.append((simulation.truth.pose.heading_deg - heading_deg) / distance_mm * 1000)
            heading_deg = simulation.truth.pose.heading_deg
            rover.turn(turn_deg)
            brick.sleep(REST_S)
            turns.append(simulation.truth.pose.heading_deg - heading_deg - turn_deg)
    return turns, drifts


def cut_motor(latency_ms: float, power: int, seed: int) -> LinkCut:
    """Cut the link at a random moment while a motor turns at a duty cycle; true degrees."""
    simulation = _simulation(seed)
    brick = Brick(SimTransport(simulation, latency_ms=latency_ms))
    brick.motor("A").dc(power)
    brick.sleep(1 + random.Random(seed).random())  # noqa: S311 - repeatable
    brick.link.transport.close()
    return _until_rest(simulation, lambda: simulation.brick.output.outputs[OutputPort.A].control.rotation)


def cut_rover(latency_ms: float, speed_mm_s: float, seed: int) -> LinkCut:
    """Cut the link at a random moment while the robot drives; true millimetres."""
    simulation = _simulation(seed)
    brick = Brick(SimTransport(simulation, latency_ms=latency_ms))
    rover = Rover(brick.link, safety=FREE)
    end = 1 + random.Random(seed).random()  # noqa: S311 - repeatable
    while brick.now() < end:
        rover.drive(speed_mm_s, 0)
        brick.sleep(min(0.05, end - brick.now()))
    brick.link.transport.close()
    return _until_rest(simulation, lambda: simulation.truth.pose.x_mm)


def _until_rest(simulation: Simulation, where: Callable[[], float]) -> LinkCut:
    begin, begun_ms = where(), simulation.now_ms
    place, moved_ms = begin, begun_ms
    while simulation.now_ms < moved_ms + 1000 * REST_S:
        simulation.advance(10)
        if abs(where() - place) >= 0.1:
            place, moved_ms = where(), simulation.now_ms
    return LinkCut(abs(place - begin), (moved_ms - begun_ms) / 1000)


def _of_a_real_brick(address: str) -> Iterator[Figure]:
    draw = random.Random(0)  # noqa: S311 - repeatable
    with open_brick(address) as brick:
        errors = [_angle_error(brick, power, draw) for power in POWERS * 5]
        yield from error_figures("run_angle", errors, 2.0, 5.0)
    for power in POWERS:
        yield from _cuts(f"dc({power})", "deg", [_cut_real(address, power) for _ in range(3)])
    yield Figure("turns, straights: only in the simulator, which reports the true pose", math.nan, "")


def _cut_real(address: str, power: int) -> LinkCut:
    """Stop sending, as a crashed program does, and read afterwards where the motor stands."""
    brick = open_brick(address)
    motor = brick.motor("A")
    motor.dc(power)
    brick.sleep(1.0)
    begin, transport = motor.angle, brick.link.transport
    transport.close()
    transport.sleep(motor.settings.lease_s * 2 + REST_S)
    brick.close()
    with open_brick(address) as fresh:
        return LinkCut(abs(rotation(fresh) - begin), math.nan)


def _angle_error(brick: Brick, power: int, draw: random.Random) -> float:
    motor: Motor = brick.motor("A")
    angle_deg = draw.randint(SHORTEST_DEG, LONGEST_DEG) * draw.choice((-1, 1))
    before = rotation(brick)
    motor.run_angle(power / 100 * FASTEST_DEG_S, angle_deg, Then.BRAKE)
    brick.sleep(REST_S)
    return rotation(brick) - before - angle_deg


def rotation(brick: Brick) -> int:
    """Return the brick's rotation count of port A, degrees."""
    return brick.request(GetOutputState(OutputPort.A)).rotation_count


def error_figures(
    name: str, errors: Sequence[float], median: float = math.nan, p95: float = math.nan
) -> Iterator[Figure]:
    """Yield median and 95th percentile of the errors' sizes in degrees, against goals where they are given."""
    sizes = sorted(map(abs, errors))
    middle, high = statistics.median(sizes), sizes[math.ceil(0.95 * len(sizes)) - 1]
    for what, value, goal in (("median error", middle, median), ("95 % of the errors", high, p95)):
        if math.isnan(goal):
            yield Figure(f"{name}: {what}", value, "deg")
        else:
            yield at_most(f"{name}: {what}", value, "deg", goal)


def _cuts(name: str, unit: str, cuts: Sequence[LinkCut]) -> Iterator[Figure]:
    yield Figure(f"link cut during {name}: farthest", max(cut.distance for cut in cuts), unit)
    if not any(math.isnan(cut.time_s) for cut in cuts):
        yield Figure(f"link cut during {name}: longest", max(cut.time_s for cut in cuts), "s")


def _simulation(seed: int, slip_percent: float = 0.0) -> Simulation:
    floor = Floor(size_mm=(6000, 4000))
    slip = Slip(jitter_percent=slip_percent)
    robot = Robot(start_mm=(1500, 2000), motor_mismatch_percent=MISMATCH_PERCENT, slip=slip)
    return Simulation(WorldFile(floor=floor, robot=robot), seed=seed)
