"""The simulated brick against recorded runs of programs whose clumps call, fire, start and stop each other at random.

Each record has a program, and after each of `TICKS` ProgStatus and the numbers of its variables. Programs that made the
firmware hang or read memory that it had not initialised were left out, and 2 of 52 for 1.32, see docs/firmware.md
section 8.6.
"""

import gzip
import json
from pathlib import Path

import pytest

from firmware_protocol.iomap import COMMAND
from firmware_protocol.system import IOMapRead
from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.versions import VERSIONS
from sim_backend.firmware.vm.memory import aligned
from tests.tools.conformance.loading import start

RECORDING = Path(__file__).parents[2] / "golden" / "clump_programs.jsonl.gz"
RECORDS = [json.loads(line) for line in gzip.decompress(RECORDING.read_bytes()).splitlines()]
TICKS, LONGEST = (9, 3, 12), 54
STATUS = COMMAND.field("ProgStatus").read().encode().hex()
SAMPLE = RECORDS[::10]
CLUMPS_AT = 34


def shown(record):
    """What the simulated brick shows."""
    program, firmware = bytes.fromhex(record["program"]), record["firmware"]
    bench = Bench(SimBrick(firmware=firmware))
    start(bench, program)
    variables = aligned(program[CLUMPS_AT] * VERSIONS[firmware].pool.clump)
    begin, size = COMMAND.field("MemoryPool").offset + variables, len(record["shown"][0][1]) // 2
    found = []
    for passes in TICKS:
        bench.control(f"!tick {passes}")
        status = int(bench.telegram(STATUS)[-2:], 16)
        reads = (IOMapRead(COMMAND.module_id, begin + at, LONGEST) for at in range(0, size, LONGEST))
        content = b"".join(bytes.fromhex(bench.telegram(read.encode().hex()))[9:] for read in reads)
        found.append([status, content[:size].hex()])
    return found


@pytest.mark.parametrize("record", SAMPLE, ids=range(len(SAMPLE)))
def test_clumps_run_as_on_the_firmware(record):
    assert shown(record) == record["shown"]


@pytest.mark.slow
def test_the_clumps_of_all_programs_run_as_on_the_firmware():
    assert [i for i, record in enumerate(RECORDS) if shown(record) != record["shown"]] == []
