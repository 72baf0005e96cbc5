"""Measure the rover's heading error with and without a compass, after turns and after drives in rooms with iron.

The wheels slip as in the sweep's classes, and the simulator provides the true heading. See docs/motion.md.
"""

from __future__ import annotations

import random
import statistics
from collections.abc import Iterable, Iterator

from behaviors.angles import wrapped_deg
from nxtdrive.brick import Brick
from nxtdrive.motion.rover import Rover, SafetyLimits
from nxtdrive.simulated.scenario import generate_scenario
from nxtdrive.transports.sim import SimTransport
from sim_backend.scenarios.handicaps import COMPASS_PORT
from sim_backend.simulation import Simulation
from sim_backend.world.sensor_tables import CompassMount, Magnet
from sim_backend.world.world_file import Floor, Robot, Slip, WorldFile

from .bench import Figure
from .program import parser

TURNS, LOST_PERCENT = 10, 8.0
IRON = Magnet(at_mm=(1800.0, 2000.0), radius_mm=800.0, deflection_deg=45.0)
"""Deflects the needle by 28 degrees where the robot turns."""
ROOMS = range(100, 130)
"""Seeds of the rooms."""
LEGS = 30
NEAR = SafetyLimits(stop_distance_mm=150.0)


def measure_compass() -> Iterable[Figure]:
    """Yield every figure of the compass."""
    for name, compass, iron in (("wheels", False, False), ("compass", True, False), ("compass near iron", True, True)):
        error = turned_error_deg(compass=compass, iron=iron)
        yield Figure(f"{TURNS} turns of 360 deg that lose {LOST_PERCENT:g} %, {name}: error", error, "deg")
    for name, compass, iron in (("wheels", False, True), ("compass", True, False), ("compass near iron", True, True)):
        yield from _figures(f"{LEGS} legs and turns in {len(ROOMS)} rooms, {name}", walked_errors(compass, iron))
    steady = walked_errors(compass=True, iron=True, slip=False)
    yield from _figures("the same with wheels that do not slip, compass near iron", steady)


def turned_error_deg(*, compass: bool, iron: bool) -> float:
    """Return the error of the heading after full turns on the spot."""
    robot = Robot(start_mm=(1500, 2000), slip=Slip(turn_percent=LOST_PERCENT))
    file = WorldFile(
        floor=Floor(size_mm=(4000, 4000)),
        robot=robot,
        sensors=(CompassMount(kind="compass", port=COMPASS_PORT),),
        magnets=(IRON,) if iron else (),
    )
    simulation = Simulation(file)
    with Brick(SimTransport(simulation)) as brick:
        rover = Rover(brick.link, compass=COMPASS_PORT if compass else None)
        for _ in range(TURNS):
            rover.turn(360)
        return abs(rover.pose().heading_deg - simulation.truth.pose.heading_deg)


def walked_errors(compass: bool, iron: bool, slip: bool = True) -> list[list[float]]:
    """Return the heading errors after each leg and turn of random walks, degrees, a list for each room.

    Args:
        compass: Whether the robot uses the compass.
        iron: Whether the room has its magnets.
        slip: Whether the wheels slip.
    """
    return [list(_walk(seed, compass, iron, slip)) for seed in ROOMS]


def _walk(seed: int, compass: bool, iron: bool, slip: bool) -> Iterator[float]:
    file = generate_scenario("compass_distortion", seed).world
    if not iron:
        file = file.model_copy(update={"magnets": ()})
    if not slip:
        file = file.model_copy(update={"robot": file.robot.model_copy(update={"slip": Slip(jitter_percent=0)})})
    simulation = Simulation(file, seed=seed)
    draw = random.Random(seed)  # noqa: S311 - repeatable
    with Brick(SimTransport(simulation)) as brick:
        rover = Rover(brick.link, compass=COMPASS_PORT if compass else None, safety=NEAR)
        rover.reset_pose()
        start_deg = simulation.truth.pose.heading_deg
        for _ in range(LEGS):
            rover.straight(draw.uniform(150, 1200))
            yield _error_deg(rover, simulation, start_deg)
            rover.turn(draw.choice((-1, 1)) * draw.uniform(30, 180))
            yield _error_deg(rover, simulation, start_deg)


def _error_deg(rover: Rover, simulation: Simulation, start_deg: float) -> float:
    """Return the size of the error of the estimated heading."""
    error_deg = rover.pose().heading_deg - (simulation.truth.pose.heading_deg - start_deg)
    return abs(wrapped_deg(error_deg))


def _figures(name: str, rooms: list[list[float]]) -> Iterator[Figure]:
    errors = sorted(error for room in rooms for error in room)
    yield Figure(f"{name}: median error", statistics.median(errors), "deg")
    yield Figure(f"{name}: 90 % of the errors", errors[round(0.9 * (len(errors) - 1))], "deg")
    yield Figure(f"{name}: median error at the end", statistics.median(room[-1] for room in rooms), "deg")


def main() -> None:
    """Print every figure."""
    parser(__doc__).parse_args()
    for figure in measure_compass():
        print(f"{figure.name:<90}{figure.value:9.1f} {figure.unit}", flush=True)


if __name__ == "__main__":
    main()
