"""Instructions for texts, which are zero-terminated arrays of bytes. Source: docs/firmware.md section 8.2."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

from sim_backend.firmware.vm.data import ERR_ARG, NONE, Data, ProgramError
from sim_backend.firmware.vm.instructions import MANY, Instruction, Translation, sized_arguments
from sim_backend.firmware.vm.machine import Machine, Translate
from sim_backend.firmware.vm.numbers import single
from sim_backend.firmware.vm.rxe import Type

_NUMBER = re.compile(
    rb"\s*([+-]?(?:0[xX][0-9a-fA-F]+|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|inf(?:inity)?|nan))", re.IGNORECASE
)
_INTEGER = re.compile(rb"\s*([+-]?\d+)")
_DIGITS = re.compile(rb"\s*[+-]?\d*\.?\d*")


def _number_to_text(machine: Machine, instruction: Instruction) -> Translation:
    data, decimals, (target, source) = machine.data, machine.dialect.decimals, instruction.arguments
    return lambda: data.set_bytes(target, format_number(data.get(source), decimals) + b"\0")


def format_number(value: float, decimals: int) -> bytes:
    """A number as text: a float with up to so many decimals."""
    if isinstance(value, float):
        text = f"{value:.{decimals}f}"
        return (text.rstrip("0").rstrip(".") if "." in text else text).encode()
    return str(value).encode()


def _text_to_number(data: Data, arguments: tuple[int, ...], *, scans_integers: bool) -> None:
    """Convert a text to a number: target, offset after it, text, offset, default."""
    target, past, source, offset, default = arguments[:5]
    start, text = data.integer_or(offset, 0) & 0xFFFF, data.text(source)
    found = (
        (_INTEGER if scans_integers and data.kind(target) != Type.FLOAT else _NUMBER).match(text, start)
        if start < len(text)
        else None
    )
    data.put(target, _float(found[1]) if found else 0 if default == NONE else data.get(default))
    digits = _DIGITS.match(text, start)
    end = digits.end() if found and digits else 0
    if past != NONE:
        data.put(past, end)
    elif data.memory.doubly_linked:  # the firmware writes it to the first byte of the variables
        data.memory.store(Type.UBYTE, 0, end)


def _float(text: bytes) -> float:
    """The value as C's scanf reads it."""
    lower = text.lower()
    return single(float.fromhex(lower.decode()) if b"0x" in lower else float(lower))


def _join(machine: Machine, instruction: Instruction) -> Translation:
    """Join texts; the entry behind that of each must be of bytes."""
    data, (target, *sources) = machine.data, sized_arguments(machine.program.code, instruction)
    if any(data.kind(source + 1) != Type.UBYTE for source in sources):

        def fail() -> None:
            raise ProgramError(ERR_ARG, "what is joined is no text")

        return fail
    return lambda: _join_texts(data, target, sources)


def _join_texts(data: Data, target: int, sources: list[int]) -> None:
    """Join texts; the target is resized before its own characters are copied, if it is a source."""
    lengths = [data.span(source)[1] for source in sources]
    length = sum(lengths) - len(lengths) + 1 & 0xFFFF
    to = data.resized(target, length)
    if not length:
        return
    if 0 in lengths:  # the firmware overwrites its memory
        raise ProgramError(ERR_ARG, "a text without a closing zero")
    for source in sources:
        at, size = data.span(source)
        data.put_bytes(to, data.memory.pool[at : at + size - 1])
        to += size - 1
    data.put_bytes(to, b"\0")


def _part_of_text(data: Data, arguments: tuple[int, ...]) -> None:
    target, source, index, length = arguments[:4]
    at, size = data.span(source)
    if not size:
        data.resized(target, 0)
        return
    size -= 1
    first = data.integer_or(index, 0) & 0xFFFF
    wanted = data.integer_or(length, size) & 0xFFFF
    count = min(wanted, max(size - first, 0))
    text = data.memory.pool[at + first : at + first + count]
    data.set_bytes(target, text + b"\0")


def _text_to_bytes(data: Data, arguments: tuple[int, ...]) -> None:
    """Copy a text without its closing zero; nothing if it does not even have that."""
    target, source = arguments
    content = data.bytes_of(source)
    if content:
        data.set_bytes(target, content[:-1])


def _bytes_to_text(data: Data, arguments: tuple[int, ...]) -> None:
    target, source = arguments
    data.set_bytes(target, data.bytes_of(source) + b"\0")


def _conversion(machine: Machine, instruction: Instruction) -> Translation:
    data, scans_integers = machine.data, machine.dialect.scans_integers
    return lambda: _text_to_number(data, instruction.arguments, scans_integers=scans_integers)


def _translator(function: Callable[[Data, tuple[int, ...]], None]) -> Translate:
    def translate(machine: Machine, instruction: Instruction) -> Translation:
        return lambda: function(machine.data, instruction.arguments)

    return translate


TABLE: Mapping[tuple[int, int], Translate] = {
    (0x1F, 2): _number_to_text,
    (0x20, MANY): _conversion,
    (0x21, MANY): _join,
    (0x22, MANY): _translator(_part_of_text),
    (0x23, 2): _translator(_text_to_bytes),
    (0x24, 2): _translator(_bytes_to_text),
}
"""Opcode and number of arguments to the function that translates it."""
