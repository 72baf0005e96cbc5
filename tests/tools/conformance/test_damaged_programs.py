"""The simulated brick against recorded runs of damaged programs.

Each record has the compiled program of `tests/golden/programs` that was damaged, the new bytes and the new size, and
ProgStatus as LEGO's firmware showed it after each of `TICKS` and after a stop. Programs that made the firmware crash or
read memory that it had not initialised were left out.
"""

import gzip
import json
from pathlib import Path

import pytest

from firmware_protocol.direct import StopProgram
from firmware_protocol.iomap import COMMAND
from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick
from tests.tools.conformance.loading import start

GOLDEN = Path(__file__).parents[2] / "golden"
RECORDS = [
    json.loads(line) for line in gzip.decompress((GOLDEN / "damaged_programs.jsonl.gz").read_bytes()).splitlines()
]
TICKS = (8, 1, 2, 3, 10, 20, 60)
SAMPLE = 30
STATUS = COMMAND.field("ProgStatus").read().encode().hex()


def content(record):
    """The damaged program."""
    result = bytearray((GOLDEN / "programs" / f"{record['program']}.rxe").read_bytes()[: record["size"]])
    for at, new in record["changes"]:
        result[at : at + len(new) // 2] = bytes.fromhex(new)
    return bytes(result)


def statuses(record):
    """What the simulated brick shows."""
    bench = Bench(SimBrick(firmware=record["firmware"]))
    program = content(record)
    assert len(program) == record["size"]
    start(bench, program)
    shown = []
    for passes in TICKS:
        bench.control(f"!tick {passes}")
        shown.append(bench.telegram(STATUS)[-2:])
    bench.telegram(StopProgram().encode().hex())
    bench.control("!tick 1")
    return "".join([*shown, bench.telegram(STATUS)[-2:]])


@pytest.mark.parametrize("record", RECORDS[:SAMPLE], ids=range(SAMPLE))
def test_a_damaged_program_ends_as_on_the_firmware(record):
    assert statuses(record) == record["statuses"]


@pytest.mark.slow
def test_all_damaged_programs_end_as_on_the_firmware():
    wrong = [i for i, record in enumerate(RECORDS) if statuses(record) != record["statuses"]]
    assert wrong == []
