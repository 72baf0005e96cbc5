"""The true room is shown in the frame of the robot's odometry, to people only."""

from __future__ import annotations

from typing import Any

import pytest

from nxtdrive.brick import Brick
from nxtdrive.tools.web.hub import Hub
from nxtdrive.tools.web.true_room import EVERY_S, TrueRoom
from nxtdrive.transports.sim import SimTransport
from sim_backend.simulation import Simulation


class Shown(Hub):
    """A hub that keeps what it is shown."""

    watched = True

    def __init__(self) -> None:
        super().__init__()
        self.rooms: list[dict[str, Any]] = []

    def show(self, kind: str, values: Any) -> None:
        assert kind == "true_room"
        self.rooms.append(values)


def test_the_robot_starts_at_zero_and_moves_ahead():
    hub, simulation = Shown(), Simulation("open", seed=1)
    with Brick(SimTransport(simulation)) as brick:
        room = TrueRoom(brick, hub)
        room.show()
        rover = brick.rover(left="B", right="C")
        rover.straight(300)
        room.show()
        rover.turn(90)
        brick.sleep(EVERY_S)
        room.show()
    begun, ahead, turned = (each["pose"] for each in hub.rooms)
    assert begun == [0.0, 0.0, 0.0]
    assert ahead == pytest.approx([300, 0, 0], abs=25)
    assert turned[2] == pytest.approx(90, abs=5)


def test_the_walls_enclose_the_robot_and_the_picture_stands_ahead():
    hub, simulation = Shown(), Simulation("open", seed=1)
    with Brick(SimTransport(simulation)) as brick:
        TrueRoom(brick, hub).show()
    lines = hub.rooms[0]["lines"]
    xs = [x for x0, _, x1, _ in lines for x in (x0, x1)]
    ys = [y for _, y0, _, y1 in lines for y in (y0, y1)]
    assert min(xs) < 0 < max(xs)
    assert min(ys) < 0 < max(ys)
    pose = simulation.truth.pictures["lena"]
    distance_mm = simulation.truth.distance_mm("lena")
    assert any(abs((x0 + x1) / 2 - distance_mm) < 100 and abs((y0 + y1) / 2) < 100 for x0, y0, x1, y1 in lines), pose


def test_it_is_shown_twice_a_second_at_most_and_only_to_clients():
    hub = Shown()
    with Brick(SimTransport(Simulation("open", seed=1))) as brick:
        room = TrueRoom(brick, hub)
        for _ in range(10):
            room.show()
            brick.sleep(EVERY_S / 5)
        assert len(hub.rooms) == 2
        hub.watched = False
        brick.sleep(1.0)
        room.show()
    assert len(hub.rooms) == 2
