"""Rules of the output module, each as a short conversation with the answers of LEGO's firmware."""

import pytest

from firmware_protocol.direct import SetOutputState
from firmware_protocol.enums import OutputMode, OutputPort, RegulationMode, RunState
from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.versions import FIRMWARES

SYNCHRONISED = OutputMode.MOTOR_ON | OutputMode.BRAKE | OutputMode.REGULATED


def state(port, power, mode=OutputMode.MOTOR_ON, regulation=RegulationMode.IDLE, run=RunState.RUNNING, limit=0) -> str:
    return SetOutputState(OutputPort(port), power, mode, regulation, 0, run, limit).encode().hex()


@pytest.mark.parametrize(
    ("firmware", "motors"),
    [("1.29", "0/0/419 0/0/449 0/0/459"), ("1.05", "0/0/419 0/0/449 0/0/459"), ("1.32", "0/0/419 0/0/449 35/1/543")],
)
def test_the_end_of_a_synchronised_ramp_stops_the_motors_of_its_version(firmware, motors):
    bench = Bench(SimBrick(firmware=firmware))
    bench.control("!also " + " ".join(state(port, 60, SYNCHRONISED, RegulationMode.SYNC) for port in range(3)))
    bench.control("!tick 600")
    ramp = [state(port, 0, SYNCHRONISED, RegulationMode.SYNC, RunState.RAMP_DOWN, 180) for port in (1, 0)]
    bench.control("!also " + " ".join(ramp))
    bench.control("!tick 900")
    assert bench.control("!motors") == motors


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_the_way_of_a_ramp_wraps_at_32_bits(firmware):
    bench = Bench(SimBrick(firmware=firmware))
    bench.control("!turn 2 -109")
    bench.control("!tick 5")
    for _ in range(2):
        bench.telegram(state(2, 30, run=RunState.IDLE, limit=1))
    bench.control("!tick 5")
    bench.telegram(state(2, -101, OutputMode.MOTOR_ON | OutputMode.BRAKE, run=RunState.RAMP_DOWN, limit=0x7FFF_FFFF))
    assert bench.control("!motors") == "0/0/0 0/0/0 -9/0/-110"
