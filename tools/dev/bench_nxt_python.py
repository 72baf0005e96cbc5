"""Compare turns by an angle with nxt-python's `Motor.turn`: same brick, same motor, same moves, in real time.

Without an address both talk to ``nxtdrive sim serve`` through its serial port. See docs/motion.md.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from nxtdrive.brick import open_brick
from nxtdrive.motion.motor import FASTEST_DEG_S, Then

from .bench import Figure
from .bench_motion import LATENCIES_MS, REST_S, error_figures, rotation
from .bench_peer import run_nxt_python, served, where

MOVES = ((40, 90), (-75, 360), (100, 720), (-40, 450), (75, 180), (-100, 270))
"""Power in percent, whose sign is the direction, and degrees."""

PROGRAM = """
with nxt.locator.find(**json.loads(sys.argv[1])) as brick:
    motor = brick.get_motor(nxt.motor.Port.A)
    for power, angle in json.loads(sys.argv[2]):
        before = motor.get_tacho().rotation_count
        motor.turn(power, angle)
        time.sleep(float(sys.argv[3]))
        turned = motor.get_tacho().rotation_count - before
        print(turned - (angle if power > 0 else -angle), flush=True)
"""


def measure_nxt_python(address: str | None = None) -> Iterator[Figure]:
    """Measure the errors at rest of nxt-python's turns and of ours, by the brick's own counter.

    Args:
        address: A real brick with a free motor on port A, on USB or at a serial port; None for the simulator at the
            latencies of a cable and of a radio.

    Raises:
        ConfigError: nxt-python cannot open such an address.
    """
    if address is not None:
        yield from _compare(address, "")
        return
    for latency_ms in LATENCIES_MS:
        with served(latency_ms) as at:
            yield from _compare(at, f", serial port, {latency_ms} ms")


def _compare(address: str, link: str) -> Iterator[Figure]:
    printed = run_nxt_python(PROGRAM, where(address), json.dumps(MOVES), str(REST_S))
    ours = error_figures(f"run_angle{link}", _our_errors(address), 2.0, 5.0)
    if printed is None:
        yield from ours
        return
    theirs = error_figures("Motor.turn", [int(line) for line in printed.split()])
    for figure, peer in zip(ours, theirs, strict=True):
        yield replace(figure, peer=peer.value)


def _our_errors(address: str) -> Sequence[float]:
    errors = []
    with open_brick(address) as brick:
        for power, angle_deg in MOVES:
            before = rotation(brick)
            brick.motor("A").run_angle(power / 100 * FASTEST_DEG_S, angle_deg, Then.BRAKE)
            brick.sleep(REST_S)
            errors.append(rotation(brick) - before - math.copysign(angle_deg, power))
    return errors
