"""Instructions for texts, which are zero-terminated arrays of bytes. Source: docs/firmware.md section 8.2."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence

from sim_backend.firmware.cint import s32
from sim_backend.firmware.vm.arrays import translator
from sim_backend.firmware.vm.data import ERR_ARG, NONE, Data, ProgramError
from sim_backend.firmware.vm.dialect import Dialect
from sim_backend.firmware.vm.instructions import MANY, Effect, Instruction, Ports, Translation, sized_arguments
from sim_backend.firmware.vm.machine import Machine, Translate
from sim_backend.firmware.vm.memory import OutOfMemory
from sim_backend.firmware.vm.numbers import Number, single
from sim_backend.firmware.vm.rxe import Type

_FLOAT = re.compile(
    rb"\s*([+-]?(?:0x(?:[0-9a-f]+\.?[0-9a-f]*|\.[0-9a-f]+)(?:p[+-]?\d+)?"
    rb"|(?!0x)(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?|inf(?:inity|(?!i))|nan))",
    re.IGNORECASE,
)
_INTEGER = re.compile(rb"\s*([+-]?\d+)")
"""Numbers as C's scanf reads them."""

_PAST_FLOAT, _PAST_FLOAT_WITH_EXPONENT = re.compile(rb"\D*\d+(?:\.\d*)?"), re.compile(rb"\D*\d+(?:\.\d*)?(?:[eE]\d*)?")
_PAST_INTEGER = re.compile(rb"\D*\d+")
"""Pattern of the number when the firmware looks for its end, from where the reading began."""

_MIN_S32, _MAX_S32 = -(1 << 31), (1 << 31) - 1
_MAX_U16 = 0xFFFF
_FIXED_LIMIT = 16
"""Largest number of characters of a float with a fixed number of decimals."""

_EXACT_DIGITS = 7
"""Digits of which each number is one of single precision."""


def _number_to_text(machine: Machine, instruction: Instruction) -> Translation:
    dialect, (target, source) = machine.dialect, instruction.arguments
    put, operands = machine.operands.function(f"text_{instruction.at}", machine.data.writer(target)), machine.operands
    text = f'b"%d\\0" % {operands.value(source)}'
    if machine.data.kind(source) == Type.FLOAT:
        convert = operands.function(f"format_{instruction.at}", lambda value: format_number(value, dialect) + b"\0")
        text = f"{convert}({operands.value(source)})"
    return Effect((f"{put}({text})",), Ports.NOTHING, takes_time=True)


def format_number(value: float, dialect: Dialect) -> bytes:
    """Return a number as text: a float with few decimals, or with an exponent if that is too long."""
    if math.isnan(value):
        return b"-nan" if math.copysign(1, value) < 0 else b"nan"
    if isinstance(value, float):
        text = f"{value:.{dialect.decimals}f}"
        if len(text) > _FIXED_LIMIT:
            text = f"{value:g}"
            return (text.rstrip("0") if dialect.cuts_exponents else text).encode()
        return text.rstrip("0").rstrip(".").encode()
    return str(value).encode()


def _text_to_number(machine: Machine, instruction: Instruction) -> Translation:
    """Convert a text to a number: target, offset after it, text, offset, default."""
    data, operands = machine.data, machine.operands
    target, past, source, offset, default = instruction.arguments[:5]
    otherwise = "0" if default == NONE else f"{operands.integer(default)} & 0xFFFFFFFF"
    scan = operands.function(f"scan_{instruction.at}", _scanner(machine, target, source))
    store = operands.assignment(target, "n") or f"put({target}, n)"
    end = "pass"
    if past != NONE:
        end = operands.assignment(past, "end") or f"put({past}, end)"
    elif data.memory.doubly_linked:  # the firmware writes it to the first byte of the variables
        end = f"pool[{data.memory.base}] = end & 255"
    start = "0" if offset == NONE else f"{operands.integer(offset)} & 65535"
    return Effect((f"n, end = {scan}({start}, {otherwise})", store, end), Ports.NOTHING, takes_time=True)


def _scanner(machine: Machine, target: int, source: int) -> Callable[[int, int], tuple[Number, int]]:
    """Return a function that returns the number in a text from an offset on, or a default, and the offset after it."""
    data, dialect, kind = machine.data, machine.dialect, machine.data.kind(target)
    find = data.finder(source)
    is_integer = dialect.scans_integers and kind != Type.FLOAT
    pattern = _INTEGER if is_integer else _FLOAT
    whole = float if kind == Type.VOID and not is_integer else int
    past = _PAST_INTEGER if is_integer else _PAST_FLOAT_WITH_EXPONENT if dialect.scans_integers else _PAST_FLOAT

    def scan(start: int, default: int) -> tuple[Number, int]:
        at = find()[0]
        text = data.text_at(at + start)
        if len(text) <= _EXACT_DIGITS and text.isdigit():
            return whole(text), start + len(text)
        found = pattern.match(text)
        if is_integer:
            number: Number = int(max(_MIN_S32, min(float(found[1]), _MAX_S32))) if found else s32(default)
        else:
            number = _float(found[1]) if found else single(default)
            number = number if kind in (Type.FLOAT, Type.VOID) else data.whole(number, kind)
        end = past.match(data.memory.pool, at + start) if found else None
        return number, end.end() - at if end else 0

    return scan


def _float(text: bytes) -> float:
    """Return the value as C's scanf reads it."""
    if b"0x" not in text.lower():
        return single(float(text))
    try:
        return single(float.fromhex(text.decode()))
    except OverflowError:
        return -math.inf if text.startswith(b"-") else math.inf


def _join(machine: Machine, instruction: Instruction) -> Translation:
    """Join texts; the entry after that of each must be of bytes."""
    data, (target, *sources) = machine.data, sized_arguments(machine.program.code, instruction)
    if any(data.kind(source + 1 & 0xFFFF) != Type.UBYTE for source in sources):

        def fail() -> None:
            raise ProgramError(ERR_ARG, "what is joined is not a text")

        return fail
    return _joiner(data, target, sources)


def _joiner(data: Data, target: int, sources: Sequence[int]) -> Callable[[], None]:
    """Return a function that joins texts; the target is resized before its own characters are copied, if it is one."""
    finders, resize = [data.finder(source) for source in sources], data.resizer(target)
    quick, pool, end, less = resize.quick, data.memory.pool, len(data.memory.pool), len(sources) - 1

    def join() -> None:
        length = -less
        for find in finders:
            length += find()[1]
        length &= 0xFFFF
        to = quick(length)
        if to < 0:
            to = resize.slow(length)
        if not length:
            return
        for find in finders:
            at, size = find()
            if not size:  # the firmware overwrites its memory
                raise ProgramError(ERR_ARG, "a text without a closing zero")
            following = to + size - 1
            if following >= end or at + size > end:
                raise OutOfMemory("outside of the memory")
            pool[to:following] = pool[at : at + size - 1]
            to = following
        pool[to] = 0

    return join


def _part_of_text(machine: Machine, instruction: Instruction) -> Translation:
    data, operands = machine.data, machine.operands
    target, source, index, length = instruction.arguments[:4]
    find, put, pool = data.finder(source), data.writer(target), data.memory.pool

    def cut(first: int, wanted: int) -> None:
        at, size = find()
        if not size:  # its length less 1 is 65535; the bytes are undefined
            put(bytes(min(wanted, _MAX_U16 - first) + 1 & _MAX_U16))
            return
        begin, end = at + first, at + size - 1
        put(pool[begin : end if end - begin < wanted else begin + wanted] + b"\0")

    first = "0" if index == NONE else f"{operands.integer(index)} & 65535"
    wanted = str(_MAX_U16) if length == NONE else f"{operands.integer(length)} & 65535"
    name = operands.function(f"cut_{instruction.at}", cut)
    return Effect((f"{name}({first}, {wanted})",), Ports.NOTHING, takes_time=True)


def _text_to_bytes(data: Data, arguments: tuple[int, ...]) -> None:
    """Copy a text without its closing zero; nothing if it has no bytes at all."""
    target, source = arguments
    size = data.span(source)[1]
    if size:
        _copy(data, data.resizer(target).slow(size - 1), source, size - 1)


def _bytes_to_text(data: Data, arguments: tuple[int, ...]) -> None:
    target, source = arguments
    size = data.span(source)[1]
    to = data.resizer(target).slow(size + 1)
    _copy(data, to, source, size)
    data.memory.write(to + size - data.memory.base, b"\0")


def _copy(data: Data, to: int, source: int, size: int) -> None:
    """Copy bytes of an array, which the resized target may have moved or overwritten, to a place in the pool."""
    memory = data.memory
    memory.write(to - memory.base, memory.read(data.span(source)[0] - memory.base, size))


TABLE: Mapping[tuple[int, int], Translate] = {
    (0x1F, 2): _number_to_text,
    (0x20, MANY): _text_to_number,
    (0x21, MANY): _join,
    (0x22, MANY): _part_of_text,
    (0x23, 2): translator(_text_to_bytes),
    (0x24, 2): translator(_bytes_to_text),
}
"""Opcode and number of arguments to the function that translates it."""
