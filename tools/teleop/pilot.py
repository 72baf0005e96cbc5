"""The control loop of teleoperation: drives, reads the sensors, draws the map; independent of the terminal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from behaviors.ports import Pose, StopReason
from nxtdrive.brick import Brick
from nxtdrive.motion.rover import Rover

from .controls import Controls
from .floor_map import FloorMap
from .spotter import Spotter

STEP_S = 0.1
"""Period of the loop, unless the link is slower; well within the lease of `Rover.drive`."""
SENSOR_PERIOD_S = 0.25
BATTERY_EVERY_S = 5.0

_REASONS = {
    StopReason.OBSTACLE: "obstacle ahead",
    StopReason.CONTACT: "bumper pressed",
    StopReason.STALLED: "wheels are stuck",
}


@dataclass(frozen=True, slots=True)
class PilotState:
    """The contents of the user interface after a step.

    Attributes:
        state: What the robot is doing, or why it does not move.
        speed_mm_s: Wanted.
        turn_deg_s: Wanted, positive right.
        percent: Percentage of the highest speeds.
        pose: By odometry.
        range_mm: Distance ahead; None without an echo or without a sonar.
        touching: Whether the bumper is pressed; False without one.
        battery_mv: Battery voltage.
        latency_ms: Round trip of the link.
        target_text: Description of the target as the camera sees it; empty without a target.
    """

    state: str
    speed_mm_s: float
    turn_deg_s: float
    percent: int
    pose: Pose
    range_mm: float | None
    touching: bool
    battery_mv: int
    latency_ms: float
    target_text: str


class Pilot:
    """Drives as the controls demand, in one thread.

    Args:
        brick: An open brick.
        rover: The same brick as a vehicle.
        controls: The operator's input.
        spotter: Looks for a target, if there is one.
        rest: Waits for a time in seconds, at the end of each step; by default `Brick.sleep`.
        floor_map: An empty map; by default one for a robot with sonar and lens above its axle.

    Attributes:
        map: Cells the robot has driven over, and echoes.
        moving: Whether the robot drives as the controls demanded last.
    """

    def __init__(
        self,
        brick: Brick,
        rover: Rover,
        controls: Controls,
        spotter: Spotter | None = None,
        rest: Callable[[float], None] | None = None,
        floor_map: FloorMap | None = None,
    ) -> None:
        self.map = floor_map or FloorMap()
        self._brick, self._rover, self._controls, self._spotter = brick, rover, controls, spotter
        self._rest = rest or brick.sleep
        self.moving = False
        self._stuck: tuple[int, int] | None = None
        self._range_mm: float | None = None
        self._touching = False
        self._battery_mv = 0
        self._sensors_due_s = self._battery_due_s = 0.0

    def step(self) -> PilotState:
        """Drive as the controls demand now and read the sensors; takes about `STEP_S`.

        Raises:
            LinkError: The link is lost; the robot stops by itself.
            BrickError: A sensor does not answer.
        """
        begun = self._brick.now()
        speed, turn = self._controls.wanted(begun)
        state = self._drive(speed, turn)
        pose = self._rover.pose()
        self.map.drive_over(pose)
        self._sense(begun, pose)
        target_text = self._look(begun, pose)
        view = PilotState(
            state=state,
            speed_mm_s=speed,
            turn_deg_s=turn,
            percent=self._controls.percent,
            pose=pose,
            range_mm=self._range_mm,
            touching=self._touching,
            battery_mv=self._battery_mv,
            latency_ms=self._brick.link.latency_s * 1000,
            target_text=target_text,
        )
        self._rest(begun + STEP_S - self._brick.now())
        return view

    def stop(self) -> None:
        """Brake at once."""
        self.moving = False
        self._rover.stop()

    def _drive(self, speed: float, turn: float) -> str:
        if _direction(speed, turn) == self._stuck:
            return f"{_REASONS[StopReason.STALLED]}, let go"
        self._stuck = None
        if speed or turn:
            reason = self._rover.drive(speed, turn)
            if reason is StopReason.STALLED:
                self._stuck = _direction(speed, turn)
            self.moving = reason is None
            return "driving" if reason is None else _REASONS.get(reason, reason.value)
        if self.moving:
            self.stop()
        return "EMERGENCY STOP until Enter" if self._controls.stopped else "at rest"

    def _sense(self, now: float, pose: Pose) -> None:
        if now >= self._sensors_due_s:
            self._sensors_due_s = now + SENSOR_PERIOD_S
            self._range_mm, self._touching = self._rover.range_mm(), self._rover.touching()
            self.map.add_echo(pose, self._range_mm)
        if now >= self._battery_due_s:
            self._battery_due_s = now + BATTERY_EVERY_S
            self._battery_mv = self._rover.battery_mv()

    def _look(self, now: float, pose: Pose) -> str:
        spotter = self._spotter
        if spotter is None:
            return ""
        spotter.look(now)
        if spotter.trouble:
            return spotter.trouble
        sighting = spotter.sighting
        if sighting is None:
            return f"{spotter.target}: not in sight"
        self.map.add_target(pose, sighting.bearing_deg, sighting.distance_mm)
        side = "right" if sighting.bearing_deg >= 0 else "left"
        at_most = "at most " if sighting.bound else ""
        away = f"{at_most}{sighting.distance_mm / 1000:.2f} m"
        return f"{spotter.target}: {away}, {abs(sighting.bearing_deg):.0f}° {side}"


def _direction(speed: float, turn: float) -> tuple[int, int]:
    """Return the direction without the speed: a thumb on a stick trembles, and a change of speed frees no wheel."""
    return (speed > 0) - (speed < 0), (turn > 0) - (turn < 0)
