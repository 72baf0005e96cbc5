"""The robot's body: a disc with two driven wheels that collides with walls, boxes and people."""

from __future__ import annotations

import math
from collections.abc import Sequence
from random import Random

import pymunk

from sim_backend.plane import on_map, within, wrapped_deg
from sim_backend.world.motor import WheelMotor
from sim_backend.world.toml_types import Point
from sim_backend.world.world_file import Carpet, Robot

GRAVITY_MM_S2 = 9810.0
DRIVEN_SHARE = 0.8
"""Share of the weight on the driven wheels; the caster carries the rest."""
BUMPER_DEG = 45.0
"""Contacts within this angle of the front press the bumper."""
SLIP_MM_S = 5.0
"""A smaller difference between the speeds of wheel and floor counts as rolling."""
REST_MM_S = 0.05
ROBOT_GROUP = 1
"""Filter group of the robot's shapes in pymunk; its own rays pass through them."""
ON_THE_FLOOR = pymunk.ShapeFilter(group=ROBOT_GROUP)
IN_THE_AIR = pymunk.ShapeFilter(group=ROBOT_GROUP, mask=0)
"""The robot touches nothing while it is carried."""


class RobotBody:
    """The robot in the physics of the floor.

    The wheels demand a motion, which friction between tyres and floor transfers up to its limit, and contacts resist.
    The motors then get the resulting load.

    Args:
        space: The physics; millimetres, kilograms and seconds.
        robot: Parameters from the world file.
        random: Random numbers for the slip of the wheels.
        carpets: Other floors; later ones cover earlier ones.

    Attributes:
        left: Left wheel and motor.
        right: Right wheel and motor.
        lifted: Whether it is carried through the air.
        contact_bearings_deg: Bearings of contacts with the body relative to its front, positive right.
    """

    def __init__(self, space: pymunk.Space, robot: Robot, random: Random, carpets: Sequence[Carpet]) -> None:
        self._robot, self._random = robot, random
        self._carpets = tuple(reversed(carpets))
        self._ground: Robot | Carpet = robot
        mismatch = robot.motor_mismatch_percent / 200.0
        self.left = WheelMotor(robot.battery_mv, 1.0 - mismatch, robot.dead_zone_percent)
        self.right = WheelMotor(robot.battery_mv, 1.0 + mismatch, robot.dead_zone_percent)
        self.contact_bearings_deg: tuple[float, ...] = ()
        self._mm_per_deg = math.pi * robot.wheel_diameter_mm / 360.0
        self._angles = (0.0, 0.0)
        self._demanded = (0.0, 0.0)
        self._kept = (1.0, 1.0)
        self.lifted = False
        self.body = pymunk.Body(robot.mass_kg, pymunk.moment_for_circle(robot.mass_kg, 0, robot.radius_mm))
        self.body.position = robot.start_mm
        self.body.angle = math.radians(robot.heading_deg)
        self._shape = shape = pymunk.Circle(self.body, robot.radius_mm)
        shape.friction = 0.3
        shape.filter = ON_THE_FLOOR
        self._wheels = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        # friction joints that pull the body along with the wheels, limited by the tyres' grip
        self._pull = pymunk.PivotJoint(self._wheels, self.body, (0, 0), (0, 0))
        self._twist = pymunk.GearJoint(self._wheels, self.body, 0.0, 1.0)
        self._pull.max_bias = self._twist.max_bias = 0.0
        self._enter(robot)
        space.add(self.body, shape, self._pull, self._twist)

    def _enter(self, ground: Robot | Carpet) -> None:
        """Set grip and drag of the floor under the robot."""
        self._ground = ground
        grip = ground.grip * self._robot.mass_kg * DRIVEN_SHARE * GRAVITY_MM_S2
        self._pull.max_force, self._twist.max_force = grip, grip * self._robot.track_mm / 2
        self._slip_torque_nm = grip / 2 * self._robot.wheel_diameter_mm / 2 * 1e-6
        for motor in (self.left, self.right):
            motor.drag(ground.drag_nm if isinstance(ground, Carpet) else 0.0)

    def _ground_here(self) -> Robot | Carpet:
        here = self.x_mm, self.y_mm
        on_top = (each for each in self._carpets if within(here, each.at_mm, each.size_mm, each.facing_deg))
        return next(on_top, self._robot)

    @property
    def x_mm(self) -> float:
        """Position of the middle of the axle."""
        return float(self.body.position.x)

    @property
    def y_mm(self) -> float:
        """Position of the middle of the axle."""
        return float(self.body.position.y)

    @property
    def heading_deg(self) -> float:
        """Direction of the front, clockwise from +x, unwrapped."""
        return math.degrees(self.body.angle)

    def place(self, at_mm: Point, heading_deg: float) -> None:
        """Move the robot to another pose, at rest."""
        self.body.position, self.body.angle = at_mm, math.radians(heading_deg)
        self.body.velocity, self.body.angular_velocity = (0.0, 0.0), 0.0
        if self.body.space is not None:
            self.body.space.reindex_shapes_for_body(self.body)

    def lift(self, to_mm: Point, heading_deg: float | None, now_ms: int, duration_ms: int) -> None:
        """Lift the robot and begin to carry it in a straight line, its wheels turning freely."""
        target = (*to_mm, self.heading_deg if heading_deg is None else heading_deg)
        self._carried = ((self.x_mm, self.y_mm, self.heading_deg), target, now_ms, max(1, duration_ms))
        self.lifted, self._shape.filter = True, IN_THE_AIR
        self.contact_bearings_deg = ()

    def carry(self, now_ms: int) -> None:
        """Move the lifted robot on, in a straight line."""
        start, target, began_ms, duration_ms = self._carried
        share = min(1.0, (now_ms - began_ms) / duration_ms)
        x, y, heading_deg = (here + share * (there - here) for here, there in zip(start, target, strict=True))
        self.place((x, y), heading_deg)

    def put_down(self) -> None:
        """Put the lifted robot down at its destination."""
        x, y, heading_deg = self._carried[1]
        self.place((x, y), heading_deg)
        self.lifted, self._shape.filter = False, ON_THE_FLOOR

    def slip_wheels(self, left: float | None, right: float | None) -> None:
        """Set the share of each wheel's motion that is lost from now on, 0..1; None keeps it."""
        self._kept = (
            self._kept[0] if left is None else 1.0 - left,
            self._kept[1] if right is None else 1.0 - right,
        )

    @property
    def turn_rate_deg_s(self) -> float:
        """Turn rate, clockwise."""
        return math.degrees(self.body.angular_velocity)

    @property
    def at_rest(self) -> bool:
        """Whether wheels and body are at rest."""
        return (
            not self.lifted
            and self.left.at_rest
            and self.right.at_rest
            and self._demanded == (0.0, 0.0)
            and not any(self.body.velocity)
        )

    @property
    def bumper_pressed(self) -> bool:
        """Whether something touches the front."""
        return self.touched(0.0, 2 * BUMPER_DEG)

    def touched(self, direction_deg: float, width_deg: float) -> bool:
        """Return whether something touches the part of the body around `direction_deg` (clockwise from the front)."""
        if not self.contact_bearings_deg:  # usual, and queried every few milliseconds
            return False
        offsets = (wrapped_deg(bearing - direction_deg) for bearing in self.contact_bearings_deg)
        return any(abs(offset) <= width_deg / 2 for offset in offsets)

    def point_mm(self, at_mm: Point) -> Point:
        """Map position of a point on the robot, given as (forward, right) of the middle of the axle."""
        return on_map((self.x_mm, self.y_mm), self.body.angle, *at_mm)

    def drive(self, duration_s: float) -> None:
        """Demand the motion that the wheels made in the last `duration_s`."""
        if self._carpets and (ground := self._ground_here()) is not self._ground:
            self._enter(ground)
        before = self._angles
        self._angles = (self.left.angle, self.right.angle)
        if self._robot.backlash_deg:
            self._angles = self._geared(self.left, before[0]), self._geared(self.right, before[1])
        left = self._wheel_speed(self.left, before[0], self._angles[0], duration_s) * self._kept[0]
        right = self._wheel_speed(self.right, before[1], self._angles[1], duration_s) * self._kept[1]
        if self.lifted:
            left = right = 0.0
        slip = self._ground.slip
        forward = (left + right) / 2 * (1.0 - slip.distance_percent / 100.0)
        turning = (left - right) / self._robot.track_mm * (1.0 - slip.turn_percent / 100.0)
        turning += math.radians(slip.veer_deg_per_m) * forward / 1000.0
        half_turn = turning * self._robot.track_mm / 2
        self._demanded = (forward + half_turn, forward - half_turn)
        heading = self.body.angle + turning * duration_s / 2
        self._wheels.velocity = (forward * math.cos(heading), forward * math.sin(heading))
        self._wheels.angular_velocity = turning

    def _geared(self, motor: WheelMotor, angle: float) -> float:
        """Return the angle of a wheel that was at `angle`: the play of the gears decides when it follows its motor."""
        play = self._robot.backlash_deg / 2
        return min(max(angle, motor.angle - play), motor.angle + play)

    def _wheel_speed(self, motor: WheelMotor, before: float, angle: float, duration_s: float) -> float:
        """Return the demanded speed of a wheel, mm/s: its rolled distance over time, or under load its free speed."""
        driven = angle != before or not self._robot.backlash_deg
        speed = motor.free_speed if motor.loaded and driven else (angle - before) / duration_s
        jitter = self._ground.slip.jitter_percent
        if speed and jitter:
            speed *= 1.0 + self._random.gauss(0.0, jitter / 100.0)
        return speed * self._mm_per_deg

    def update_contacts(self) -> None:
        """Record the contacts and set the motors' loads after a physics step."""
        if self.lifted:
            self.left.unload()
            self.right.unload()
            return
        velocity, angle = self.body.velocity, self.body.angle
        forward = velocity.x * math.cos(angle) + velocity.y * math.sin(angle)
        half_turn = self.body.angular_velocity * self._robot.track_mm / 2
        self._load(self.left, self._demanded[0], forward + half_turn)
        self._load(self.right, self._demanded[1], forward - half_turn)
        if self._demanded == (0.0, 0.0) and abs(velocity.x) + abs(velocity.y) + abs(half_turn) < REST_MM_S:
            self.body.velocity, self.body.angular_velocity = (0.0, 0.0), 0.0
        contacts: list[float] = []
        self.body.each_arbiter(self._note_contact, contacts)
        self.contact_bearings_deg = tuple(contacts)

    def _load(self, motor: WheelMotor, demanded_mm_s: float, ground_mm_s: float) -> None:
        if abs(demanded_mm_s - ground_mm_s) > SLIP_MM_S:
            motor.load(ground_mm_s / self._mm_per_deg, self._slip_torque_nm)
        else:
            motor.unload()

    def _note_contact(self, arbiter: pymunk.Arbiter, contacts: list[float]) -> None:
        for point in arbiter.contact_point_set.points:
            offset = point.point_a - self.body.position
            bearing = math.degrees(math.atan2(offset.y, offset.x)) - self.heading_deg
            contacts.append(wrapped_deg(bearing))
