"""Instructions for arrays and texts; a text is a zero-terminated array of bytes.

Source: docs/firmware.md section 8.2.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial

import numpy as np

from sim_backend.firmware.vm import aggregates, bulk
from sim_backend.firmware.vm.array_descriptor import Array
from sim_backend.firmware.vm.bulk import Again
from sim_backend.firmware.vm.data import ERR_ARG, NONE, Data, Place, ProgramError
from sim_backend.firmware.vm.instructions import MANY, Effect, Instruction, Ports, Translation, sized_arguments
from sim_backend.firmware.vm.machine import Machine, Translate
from sim_backend.firmware.vm.numbers import SCALARS
from sim_backend.firmware.vm.operands import INTEGERS
from sim_backend.firmware.vm.plans import Elements, element_reader, element_writer, fixed, repeatable
from sim_backend.firmware.vm.rxe import Type, size_of


def _element(place: Place, array: Array, number: int) -> Place:
    return Place(place.entry + 1, array.offset + number * array.element)


def _index(data: Data, arguments: tuple[int, ...]) -> None:
    target, source, index = arguments
    number, array = data.integer_or(index, 0) & 0xFFFF, data.array(Place(source))
    if number >= array.length:
        raise ProgramError(ERR_ARG, f"an array has no element {number}")
    aggregates.move(data, Place(target), _element(Place(source), array, number))


def _replace(data: Data, arguments: tuple[int, ...], *, whole: bool) -> None:
    """Copy an array with some elements replaced: by one value, or by those of an array.

    Args:
        data: The variables.
        arguments: Target, source, index, new value or values.
        whole: Whether an array can be one value, where the elements are arrays.
    """
    target, source, index, new = (Place(argument) for argument in arguments[:4])
    if target != source:
        aggregates.move(data, target, source)
    first, array = data.integer_or(index.entry, 0) & 0xFFFF, data.array(target)
    if first >= array.length:
        return
    if data.kind(new.entry) != Type.ARRAY or (whole and _depth(data, new.entry) < _depth(data, target.entry)):
        aggregates.move(data, _element(target, array, first), new)
        return
    values = data.array(new)
    for i in range(min(values.length, array.length - first)):
        aggregates.move(data, _element(target, array, first + i), _element(new, values, i))


def _index_number(machine: Machine, instruction: Instruction) -> Translation:
    """Fast for numbers."""
    target, array, index = instruction.arguments
    operands = machine.operands
    if _is_simple(machine, array, index) and operands.scalars(target) and not _truncates(machine, target, array + 1):
        read = operands.function(f"element_{instruction.at}", element_reader(machine.data, array))
        elements = Elements(machine, instruction, array, SCALARS[machine.data.kind(array + 1)].format[-1])
        value = f"({elements.numbers}[n] if n < {elements.count} else {read}(n))"
        statement = operands.assignment(target, value)
        if statement:
            return Effect((elements.locate, f"n = {_value_or_0(machine, index)} & 65535", statement), Ports.NOTHING)
    return lambda: _index(machine.data, instruction.arguments)


def _replace_number(machine: Machine, instruction: Instruction) -> Translation:
    """Fast if an integer is replaced by a number in the same array."""
    target, array, index, new = instruction.arguments[:4]
    data, operands = machine.data, machine.operands
    integers = data.kind(new) in INTEGERS and data.kind(array + 1) in INTEGERS
    if integers and target == array and _is_simple(machine, array, index):
        write = operands.function(f"element_{instruction.at}", element_writer(data, array))
        layout = SCALARS[data.kind(array + 1)]
        elements = Elements(machine, instruction, array, layout.format[-1].upper())
        value, mask = operands.value(new), (1 << 8 * layout.size) - 1
        statements = (
            elements.locate,
            f"n = {_value_or_0(machine, index)} & 65535",
            f"if n < {elements.count}: {elements.numbers}[n] = {value} & {mask}",
            f"else: {write}(n, {value})",
        )
        return Effect(statements, Ports.NOTHING, takes_time=True)
    whole = machine.dialect.replaces_arrays
    return lambda: _replace(data, instruction.arguments, whole=whole)


def _is_simple(machine: Machine, array: int, index: int) -> bool:
    """Return whether a variable is an array of numbers, and an index is a number or omitted."""
    data = machine.data
    if not fixed(data, [array]) or data.kind(array + 1) not in SCALARS:
        return False
    return index == NONE or machine.operands.scalars(index)


def _truncates(machine: Machine, target: int, source: int) -> bool:
    return machine.data.kind(source) == Type.FLOAT != machine.data.kind(target)


def _value_or_0(machine: Machine, index: int) -> str:
    return "0" if index == NONE else machine.operands.integer(index)


def _size(data: Data, arguments: tuple[int, ...]) -> None:
    target, source = arguments
    data.put(target, data.array(Place(source)).length)


def _build(data: Data, arguments: tuple[int, ...], *, copies: bool) -> None:
    """Concatenate values and arrays; the target is resized before its own elements are copied, if it is a source.

    The elements of an array of the target's type are copied, one of another type counts as one value.

    Args:
        data: The variables.
        arguments: Target and sources.
        copies: Whether arrays of the same type are copied as they are.
    """
    target, *sources = (Place(argument) for argument in arguments)
    shape = _shape(data, target.entry)
    whole = [_shape(data, source.entry) == shape for source in sources]
    data.resize(
        target, sum(data.array(source).length if all_ else 1 for source, all_ in zip(sources, whole, strict=True))
    )
    number = 0
    for source, all_ in zip(sources, whole, strict=True):
        count = data.array(source).length if all_ else 1
        if all_ and copies and aggregates.same_integers(data, target.entry + 1, source.entry + 1):
            own = data.array(target)
            data.memory.write(own.offset + number * own.element & 0xFFFF, data.memory.bytes_of(data.index(source)))
        else:
            for i in range(count):
                part = _element(source, data.array(source), i) if all_ else source
                aggregates.move(data, _element(target, data.array(target), number + i), part)
        number += count


def _shape(data: Data, entry: int) -> tuple[object, ...]:
    """Return the types that a variable consists of."""
    kind = data.kind(entry)
    inner = [entry + 1] if kind == Type.ARRAY else data.members(entry) if kind == Type.CLUSTER else []
    return kind, *(_shape(data, part) for part in inner)


def _depth(data: Data, entry: int) -> int:
    depth = 0
    while data.kind(entry + depth) == Type.ARRAY:
        depth += 1
    return depth


def _part(data: Data, part: tuple[int, int], length: int) -> tuple[int, int]:
    """Return the first element and the number of elements of a part of an array, given by two variables."""
    first = data.integer_or(part[0], 0) & 0xFFFF
    wanted = data.integer_or(part[1], length) & 0xFFFF
    return first, max(min(wanted, length - first), 0)


def _subset_repeated(data: Data, part: tuple[int, int], length: int, target: bulk.Row, source: bulk.Row) -> Again:
    if part == (NONE, NONE):
        return bulk.bytes_copy(data, target.at, source.at, target.size)
    return partial(_subset_again, data, part, length, target, source)


def _subset_again(data: Data, part: tuple[int, int], length: int, target: bulk.Row, source: bulk.Row) -> bool:
    first, count = _part(data, part, length)
    if count != target.length or not bulk.copies(target, source, first):
        return False
    bulk.copy(data, target, source, first)
    return True


def _subset(data: Data, arguments: tuple[int, ...]) -> Again | None:
    target, source, index, length = arguments[:4]
    array = data.array(Place(source))
    first, count = _part(data, (index, length), array.length)
    data.resize(Place(target), count)
    rows = [bulk.row(data, Place(entry)) for entry in (target, source)]
    if rows[0] and rows[1]:
        source_row = rows[1]._replace(at=data.memory.base + array.offset)
        if bulk.copies(rows[0], source_row, first):
            bulk.copy(data, rows[0], source_row, first)
            return _subset_repeated(data, (index, length), array.length, rows[0], source_row)
    table, indices = data.memory.array, [data.index_of(argument) for argument in (target, source)]
    for i in range(count):
        to, of = (table(index) for index in indices)
        aggregates.move(data, _element(Place(target), to, i), _element(Place(source), of, first + i))
    return None


def _initialise(data: Data, arguments: tuple[int, ...], *, offsets: bool) -> Again | None:
    """Fill an array with a value; with `offsets`, the offset of a number in the table is added to its own."""
    target, value, length = arguments
    count = data.integer_or(length, 0) & 0xFFFF
    data.resize(Place(target), count)
    own = 0 if offsets else _own_offset(data, target + 1)
    row = bulk.row(data, Place(target))
    number = bulk.source(data, Place(value), row) if row and count else None
    if row and number and number.single:
        aggregates.move(data, Place(target + 1, data.array(Place(target)).offset), Place(value))
        bulk.fill(data, row)
        fill = bulk.calculation(data, np.positive, row, [number])
        return fill and (lambda: data.integer_or(length, 0) & 0xFFFF == count and fill())
    index = data.index_of(target)
    for i in range(count):
        element = _element(Place(target), data.memory.array(index), i)
        aggregates.move(data, Place(element.entry, element.offset - own), Place(value))
    return None


def _own_offset(data: Data, entry: int) -> int:
    """Return the offset that the table has of the numbers in an array; other than 0 only in damaged programs."""
    return 0 if data.is_aggregate(entry) else data.entry(entry).data


def _flatten(data: Data, arguments: tuple[int, ...]) -> None:
    """Store a value's bytes, without lengths of arrays, and a zero in a text, which is resized first."""
    target, source = arguments
    size = sum(len(part) for part in _scalars(data, Place(source), lambda part: part))
    at = data.resizer(target).slow(size + 1) - data.memory.base
    for part in _scalars(data, Place(source), lambda part: part):
        data.memory.write(at, part)
        at += len(part)
    data.memory.write(at, b"\0")


def _unflatten(data: Data, arguments: tuple[int, ...]) -> None:
    """Read a value from the text of `_flatten`: target, whether it failed, text, default, which gives the lengths."""
    target, failed, source, default = arguments[:4]
    if target != default:
        aggregates.move(data, Place(target), Place(default))
    text, at = data.bytes_of(source), 0
    fits = len(b"".join(_scalars(data, Place(target), lambda part: part))) + 1 == len(text)

    def following(part: bytes) -> bytes:
        nonlocal at
        at += len(part)
        return text[at - len(part) : at]

    if fits:
        list(_scalars(data, Place(target), following))
    data.put(failed, int(not fits))


def _scalars(data: Data, place: Place, replace: Callable[[bytes], bytes]) -> Iterator[bytes]:
    """Return the bytes of each scalar in a value, or of an array of scalars, which are replaced."""
    memory = data.memory
    memory.spend(1)
    if data.kind(place.entry) == Type.ARRAY and not data.is_aggregate(place.entry + 1):
        array = data.array(place)
        offset, size = array.offset, array.size
    elif data.is_aggregate(place.entry):
        for part in data.parts(place):
            yield from _scalars(data, part, replace)
        return
    else:
        offset, size = data.address(place), size_of(data.kind(place.entry))
    content = memory.read(offset, size)
    memory.write(offset, replace(content))
    yield content


def translator(function: Callable[[Data, tuple[int, ...]], None]) -> Translate:
    """Return the translation of instructions into calls with the data and the arguments."""

    def translate(machine: Machine, instruction: Instruction) -> Translation:
        data, arguments = machine.data, instruction.arguments
        return lambda: function(data, arguments)

    return translate


def _construction(machine: Machine, instruction: Instruction) -> Translation:
    data, copies = machine.data, machine.dialect.builds_at_once
    arguments = sized_arguments(machine.program.code, instruction)
    return lambda: _build(data, arguments, copies=copies)


def _of_arrays(
    machine: Machine, instruction: Instruction, perform: Callable[[], Again | None], count: int
) -> Translation:
    """Translate an instruction whose first arguments are arrays."""
    return repeatable(machine, instruction, instruction.arguments[:count], perform)


def _part_of_array(machine: Machine, instruction: Instruction) -> Translation:
    return _of_arrays(machine, instruction, lambda: _subset(machine.data, instruction.arguments), 2)


def _filling(machine: Machine, instruction: Instruction) -> Translation:
    data, offsets = machine.data, not machine.dialect.builds_at_once
    return _of_arrays(machine, instruction, lambda: _initialise(data, instruction.arguments, offsets=offsets), 1)


TABLE: Mapping[tuple[int, int], Translate] = {
    (0x15, 3): _index_number,
    (0x16, MANY): _replace_number,
    (0x17, 2): translator(_size),
    (0x18, MANY): _construction,
    (0x19, MANY): _part_of_array,
    (0x1A, 3): _filling,
    (0x1D, 2): translator(_flatten),
    (0x1E, MANY): translator(_unflatten),
}
"""Opcode and number of arguments to the function that translates it."""
