"""The simulated brick against recorded programs: status, mailboxes, motors, screen, free flash every 20 ms, files."""

import gzip
import json
from pathlib import Path

import pytest

from nxtdrive.tools.conformance.bench import Bench
from nxtdrive.tools.conformance.program_run import events_of, given_files, run_program
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.versions import VERSIONS
from sim_backend.firmware.vm import blocks
from sim_backend.firmware.vm.instructions import decode
from sim_backend.firmware.vm.opcodes import OPCODES
from sim_backend.firmware.vm.rxe import parse

GOLDEN = Path(__file__).parents[2] / "golden"
PROGRAMS = GOLDEN / "programs"
SOURCES = {path.stem: path.read_text() for path in sorted(PROGRAMS.iterdir()) if path.suffix in (".nxc", ".nbc")}
RUNS = [json.loads(line) for line in gzip.decompress((GOLDEN / "program_runs.jsonl.gz").read_bytes()).splitlines()]
DIALECT = VERSIONS["1.29"].dialect
SYSTEM_CALL = 0x28


def name_of(recorded):
    return f"{recorded['program']}-{recorded['firmware']}"


def exchange_with(brick):
    bench = Bench(brick)
    return bench.answer


@pytest.mark.parametrize("often", [pytest.param(1, id="compiled at once"), blocks.OFTEN])
@pytest.mark.parametrize("recorded", [pytest.param(run, id=name_of(run)) for run in RUNS])
def test_programs_do_the_same_as_on_the_firmware(recorded, often, monkeypatch):
    monkeypatch.setattr(blocks, "OFTEN", often)
    source = SOURCES[recorded["program"]]
    run = run_program(
        exchange_with(SimBrick(firmware=recorded["firmware"])),
        (PROGRAMS / recorded["file"]).read_bytes(),
        events_of(source),
        given_files(source),
    )
    assert [list(sample) for sample in run.samples] == recorded["samples"]
    assert run.files == recorded["files"]


def test_every_program_is_recorded():
    everywhere = [source for source in SOURCES if (PROGRAMS / f"{source}.rxe").exists()]
    names = [f"{source}-1.29" for source in everywhere] + [f"{source}-1.32" for source in SOURCES]
    assert [name_of(run) for run in RUNS] == names


def instructions(path):
    code, at = parse(path.read_bytes()).code, 0
    while at < len(code):
        instruction = decode(code, at, checks_short_forms=False)
        yield instruction
        at = instruction.following


def test_the_programs_use_every_instruction_and_every_system_call():
    used, calls = set(), set()
    for program in sorted(PROGRAMS.glob("*.rxe")):
        for instruction in () if program.name.endswith(".1.32.rxe") else instructions(program):
            used.add(instruction.opcode)
            if instruction.opcode == SYSTEM_CALL:
                calls.add(instruction.arguments[0])
    assert used == {opcode for opcode, _ in OPCODES} - DIALECT.missing
    assert calls == set(range(DIALECT.system_calls))
