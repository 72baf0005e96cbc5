"""The start of a program looks for files of calibrations, which FindNext shows afterwards."""

import pytest

from firmware_protocol import direct, system
from firmware_protocol.status import Status
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, store
from sim_backend.firmware.brick import SimBrick
from tests.sim_backend.firmware.asking import status_of

PROGRAM = assemble(Variables(), [[0x4025, 0]])


def started(firmware, *, files=(), opened=0):
    brick = SimBrick(firmware=firmware)
    for name in (*files, "p.rxe"):
        store(brick, name, PROGRAM)
    for _ in range(opened):
        assert status_of(brick, system.OpenRead("p.rxe")) == Status.OK
    assert status_of(brick, direct.StartProgram("p.rxe")) == Status.OK
    brick.tick(9)
    return brick


@pytest.mark.parametrize("files", [(), ("one.cal",), ("one.cal", "two.cal")])
@pytest.mark.parametrize(("firmware", "status"), [("1.05", 0), ("1.29", 0x87), ("1.32", 0x87)])
def test_the_listing_of_calibrations_is_at_its_end(firmware, status, files):
    assert status_of(started(firmware, files=files), system.FindNext(1)) == status


@pytest.mark.parametrize(("firmware", "status"), [("1.05", Status.NO_MORE_HANDLES), ("1.29", Status.OK)])
def test_without_a_free_handle_the_listing_closes_handle_0(firmware, status):
    assert status_of(started(firmware, opened=15), system.OpenRead("p.rxe")) == status
