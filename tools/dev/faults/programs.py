"""Campaign: any program file, through the loader and the interpreter of the simulated brick."""

from __future__ import annotations

import time
from functools import cache
from random import Random

from firmware_protocol.direct import GetBatteryLevel, MessageRead, MessageWrite, StartProgram
from firmware_protocol.iomap import COMMAND, ProgramStatus
from sim_backend.devices.analog import AnalogInput
from sim_backend.devices.digital import GenericI2CDevice
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.motors.bench_motor import BenchMotor
from sim_backend.firmware.versions import FIRMWARES
from sim_backend.firmware.vm.pool_layout import POOL_SIZE
from sim_backend.firmware.vm.rxe import Type
from sim_backend.firmware.vm.syscalls import CALLS

from .assembler import Variables, Words, assemble, instruction, store
from .campaign import Campaign, GuaranteeViolated, Tally, Violation
from .hostile import mutated, peak_memory_kb
from .program_mutation import compiled_programs, damaged

BATCH = 20
"""Programs that one brick gets."""

START_MS, STEPS_MS = 10, (1, 5, 40)
"""How long a program takes to start, and then runs; it gets messages in between."""

TIME_LIMIT_S = 5.0
"""Largest processor time of one program; the slowest sensible ones take a hundredth of it."""

MEMORY_LIMIT_KB = 64 * 1024
"""Largest memory that a batch may need."""

NAME = "a.rxe"
_COMPILED_SHARE = 0.7
_compiled = cache(compiled_programs)
_CALL = 0x28
_ENDS = (instruction(0x2A, 0, 0), instruction(0x25, 0), instruction(0x25, -6))
_FORMS = {
    **dict.fromkeys((0x00, 0x01, 0x03, 0x04, 0x05, 0x06, 0x07, 0x08, 0x11, 0x1A), "nnn"),
    **dict.fromkeys((0x02, 0x09, 0x12, 0x1B, 0x36, 0x37), "nn"),
    **dict.fromkeys((0x23, 0x24, 0x1B), "tt"),
    **dict.fromkeys((0x30, 0x32, 0x33), "nni"),
    **dict.fromkeys((0x19, 0x22), "ttxx"),
    0x15: "ntx", 0x16: "ttxn", 0x17: "nt", 0x18: "ttttt", 0x1A: "tnn", 0x1C: "ni", 0x1D: "tn", 0x1E: "nntn",
    0x1F: "tn",
    0x20: "nntxx", 0x21: "ttt", 0x25: "j", 0x26: "jnn", 0x27: "jn", 0x29: "x", 0x2A: "ii", 0x2B: "i", 0x2C: "m",
    0x2D: "m", 0x2E: "in", 0x2F: "n", 0x31: "ninin", 0x34: "xn", 0x35: "n",
}  # fmt: skip
"""Arguments of the instructions: number, text, mutex, optional number, index or field, jump."""

_CALLS = sorted(CALLS)
_MEMBERS: dict[int, tuple[int | bytes, ...]] = {
    0: (0, 0, b"c.txt\0", 0),
    1: (0, 0, b"c.txt\0", 64),
    2: (0, 0, b"c.txt\0", 0),
    3: (0, 0, b"\0", 8),
    4: (0, 0, b"some data\0", 9),
    5: (0, 0),
    8: (0, b"c.txt\0"),
    9: (0, b"b.rso\0", 0, 3),
    11: (0, 0),
    12: (0, 4, 0),
    21: (0, 3, b"\x02\x42", 1),
    22: (0, 3, b"\0", 1),
    23: (0, 3, 0),
    24: (0,),
    25: (0,),
    26: (0, 10, b"message\0"),
    27: (0, 1, 1, b"\0"),
    31: (0,),
    32: (0, b"Output.mod\0", 0, 32, b"\0"),
    33: (0, b"Command.mod\0", 52, b"\xff\xff\xff\xff"),
}
"""Arguments of the system calls; the others take five numbers."""


def run(seed: int, numbers: range) -> Tally:
    """Run these programs, each batch on a brick of its own."""
    tally = Tally()
    rng = Random(f"{seed} {numbers.start // BATCH}")  # noqa: S311 - repeatable
    brick = _brick(rng)
    before_kb = peak_memory_kb()
    for number in numbers:
        content = _content(rng)
        begun = time.process_time()
        try:
            outcome = _try(brick, rng, content)
            if (took_s := time.process_time() - begun) > TIME_LIMIT_S:
                raise GuaranteeViolated(f"it took {took_s:.0f} s")
            if peak_memory_kb() - before_kb > MEMORY_LIMIT_KB:
                raise GuaranteeViolated("the batch needs more than 64 MB")
            tally.outcomes[outcome] += 1
        except Exception as error:  # noqa: BLE001 - that is what the campaign looks for
            tally.violations.append(Violation(number, f"{error!r} {content.hex()}"))
            brick, before_kb = _brick(rng), peak_memory_kb()
    return tally


def _content(rng: Random) -> bytes:
    """Return a damaged compiled program, or one of random instructions, some of which are damaged as well."""
    if rng.random() < _COMPILED_SHARE:
        return damaged(rng, rng.choice(_compiled()))
    content = random_program(rng)
    for _ in range(rng.choice((0, 0, 0, 1, 3))):
        content = mutated(rng, content)
    return content


def _brick(rng: Random) -> SimBrick:
    brick = SimBrick(firmware=rng.choice(FIRMWARES))
    for port in "ABC":
        brick.attach_motor(port, BenchMotor())
    brick.attach_sensor(1, AnalogInput(lambda: rng.randrange(1024)))
    brick.attach_sensor(4, GenericI2CDevice())
    return brick


def _try(brick: SimBrick, rng: Random, content: bytes) -> str:
    """Store, start and run one program, end it, and return its outcome."""
    store(brick, NAME, content)
    brick.receive(StartProgram(NAME).encode())
    brick.tick(START_MS)
    status = COMMAND.field("ProgStatus").read().encode()
    loaded = brick.receive(status)
    for step_ms in STEPS_MS:
        brick.receive(MessageWrite(rng.randrange(20), 3, b"hi\0").encode())
        brick.tick(step_ms)
        brick.receive(MessageRead(rng.randrange(20), 0, True).encode())
    ended = ProgramStatus((brick.receive(status) or b"\xff")[-1])
    pool = len(brick.command.pool)
    brick.receive(b"\x00\x01")
    brick.tick(1000)
    brick.loader.erase()
    brick.io_control.power_word = brick.ui.registers.force_off = 0
    wrong = wrong_reply(brick)
    if pool != POOL_SIZE:
        raise GuaranteeViolated(f"the memory pool has {pool} bytes")
    if wrong:
        raise GuaranteeViolated(f"{wrong}")
    return f"{'started' if loaded and loaded[-1] == ProgramStatus.RUNNING else 'not started'}, {ended.name.lower()}"


def wrong_reply(brick: SimBrick) -> str:
    """Ask a plain question, and return what is wrong with the reply; an empty string if nothing is."""
    reply = brick.receive(GetBatteryLevel().encode())
    if reply is None or not reply.startswith(GetBatteryLevel.encode_reply()):
        return f"GetBatteryLevel gets the reply {reply!r}"
    return ""


def random_program(rng: Random) -> bytes:
    """Return a program of random instructions over variables of all types; many of the instructions make sense."""
    variables = Variables()
    numbers = [
        variables.number(rng.choice((0, 0, 1, 1, 2, 2, 3, 100, -1, 0x7FFF_FFFF)), rng.choice((Type.SLONG, Type.ULONG)))
        for _ in range(6)
    ]
    variables.number(0, Type.MUTEX)
    texts = [variables.text(content) for content in (b"\0", b"12\0", bytes(rng.randrange(1, 200)))]
    calls = {call: variables.call(*_MEMBERS.get(call, (0,) * 5))[0] for call in rng.sample(_CALLS, 6)}
    clumps = [
        [*(_instruction(rng, numbers, texts, calls) for _ in range(rng.randint(3, 20))), rng.choice(_ENDS)]
        for _ in range(rng.randint(1, 3))
    ]
    fire = [0, *(rng.choice((0, 1)) for _ in clumps[1:])]
    dependents = [[rng.randrange(len(clumps))] for _ in clumps]
    return assemble(variables, *clumps, fire=fire, dependents=dependents)


def _instruction(rng: Random, numbers: list[int], texts: list[int], calls: dict[int, int]) -> Words:
    opcode = rng.choice(sorted(_FORMS))
    if opcode == _CALL or rng.random() < 0.2:
        call = rng.choice(list(calls))
        return instruction(_CALL, call, calls[call])
    choices = {
        "n": numbers,
        "t": texts,
        "m": [numbers[-1] + 1],
        "x": [0xFFFF, *numbers],
        "i": range(6),
        "j": range(-20, 20),
    }
    arguments = [rng.choice(choices[kind]) for kind in _FORMS[opcode]]
    if rng.random() < 0.03:
        arguments[rng.randrange(len(arguments))] = rng.choice((*numbers, *texts, *calls.values(), rng.getrandbits(16)))
    return instruction(opcode, *arguments, flags=rng.randrange(6))


CAMPAIGN = Campaign(
    guarantee="No program file makes the simulated brick fail, hang or grow: it ends with an error, or runs.",
    unit="programs",
    count=20_000,
    batch=BATCH,
    run=run,
)
