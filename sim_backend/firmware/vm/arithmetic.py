"""Instructions that calculate, compare and copy. Source: docs/firmware.md section 8.2."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from sim_backend.firmware.cint import divide, s16
from sim_backend.firmware.vm import aggregates, scalars
from sim_backend.firmware.vm.aggregates import COMPARISONS, HOLD_FOR_EQUALS, comparable
from sim_backend.firmware.vm.bulk import EXACT, Again
from sim_backend.firmware.vm.data import ERR_INSTR, Place, ProgramError
from sim_backend.firmware.vm.instructions import Instruction, Translation
from sim_backend.firmware.vm.machine import Machine, Translate
from sim_backend.firmware.vm.numbers import SIGNED
from sim_backend.firmware.vm.operands import INTEGERS
from sim_backend.firmware.vm.plans import repeatable
from sim_backend.firmware.vm.rxe import SIZES, Type

_RELATIONS = ("<", ">", "<=", ">=", "==", "!=")
"""The comparison of each number in an instruction's flags, see `aggregates.COMPARISONS`."""

_SYMBOLS = {scalars.ADD: "+", scalars.SUB: "-", scalars.MUL: "*", scalars.AND: "&", scalars.OR: "|", scalars.XOR: "^"}
"""Operations whose low bits do not depend on the signs."""

_FACTORS = {scalars.ADD: (1, 1, 0), scalars.SUB: (1, -1, 0), scalars.NEG: (-1, 0)}
"""Factors of the operands, and last of 1, of operations whose result is a sum."""

_SIGN = 0x8000_0000


def _kinds(machine: Machine, instruction: Instruction) -> list[int]:
    return [machine.data.kind(argument) for argument in instruction.arguments]


def _unsigned(machine: Machine, argument: int) -> str:
    """Return a number as an unsigned one of 32 bits."""
    value = machine.operands.value(argument)
    return f"({value} & 0xFFFFFFFF)" if machine.data.kind(argument) in SIGNED else value


def _comparable(machine: Machine, left: int, right: int) -> tuple[str, str]:
    """Return the expressions of two scalars as they are compared and divided, see `aggregates.comparable`."""
    kinds = machine.data.kind(left), machine.data.kind(right)
    if Type.FLOAT in kinds:
        first, second = (
            "0" if machine.data.kind(it) == Type.VOID else machine.operands.value(it) for it in (left, right)
        )
        return first, second
    if kinds[0] in SIGNED and kinds[1] in SIGNED:
        return machine.operands.value(left), machine.operands.value(right)
    return _unsigned(machine, left), _unsigned(machine, right)


def _comparison(machine: Machine, relation: int, left: int, right: int) -> str:
    """Return the expression of whether a comparison of two scalars holds."""
    first, second = _comparable(machine, left, right)
    return related(first, relation, second)


def whole_comparison(machine: Machine, relation: int, left: int, right: int) -> str:
    """Return the same for a jump, which converts floats to integers with a sign."""
    operands, kinds = machine.operands, (machine.data.kind(left), machine.data.kind(right))
    if Type.FLOAT not in kinds:
        return _comparison(machine, relation, left, right)
    first, second = operands.integer(left), operands.integer(right)
    if all(kind in (*SIGNED, Type.FLOAT) for kind in kinds):
        return related(as_signed(first), relation, as_signed(second))
    return related(f"({first} & 0xFFFFFFFF)", relation, f"({second} & 0xFFFFFFFF)")


def as_signed(value: str) -> str:
    """Return the expression of the low 32 bits of an integer as a number with a sign."""
    return f"(({value} + {_SIGN} & 0xFFFFFFFF) - {_SIGN})"


def related(left: str, relation: int, right: str) -> str:
    """Return the expression of whether a comparison of two expressions holds."""
    return f"{left} {_RELATIONS[relation]} {right}" if relation < len(_RELATIONS) else "False"


def _binary(machine: Machine, instruction: Instruction) -> Translation:
    data, operands, opcode = machine.data, machine.operands, instruction.opcode
    target, left, right = (Place(argument) for argument in instruction.arguments)
    value = _calculation(machine, instruction) if operands.scalars(*instruction.arguments) else None
    effect = operands.calculation(instruction.arguments, value, _FACTORS.get(opcode)) if value else None
    operation = scalars.binary(opcode, float_remainder=machine.dialect.float_remainder)
    whole = scalars.WHOLE.get(opcode)
    return effect or _of_arrays(
        machine, instruction, lambda: aggregates.calculate(data, operation, target, left, right, whole)
    )


def _of_arrays(machine: Machine, instruction: Instruction, perform: Callable[[], Again | None]) -> Translation:
    arrays = [argument for argument in instruction.arguments if machine.data.kind(argument) == Type.ARRAY]
    return repeatable(machine, instruction, arrays, perform)


def _calculation(machine: Machine, instruction: Instruction) -> str | None:
    """Return the expression of an operation of two scalars; None if it needs conversions."""
    operands, opcode = machine.operands, instruction.opcode
    _, left, right = instruction.arguments
    kinds = _kinds(machine, instruction)
    symbol = _SYMBOLS.get(opcode)
    if Type.FLOAT not in kinds:
        if symbol:
            return f"{operands.value(left)} {symbol} {operands.value(right)}"
        function = operands.function(*(("divide", divide) if opcode == scalars.DIV else ("rest", scalars.remainder)))
        return f"{function}({', '.join(_comparable(machine, left, right))})"
    if kinds[0] == Type.FLOAT and kinds[1] in EXACT and kinds[2] in EXACT:
        if symbol in ("+", "-"):
            return f"{operands.value(left)} {symbol} {operands.value(right)}"
        if symbol == "*":  # 0 times a negative number is -0.0
            return f"float({operands.value(left)}) * {operands.value(right)}"
        if opcode == scalars.DIV:
            function = operands.function("quotient", scalars.float_divide)
            return f"{function}({operands.value(left)}, {operands.value(right)})"
    return None


def _negation_of_two(machine: Machine, instruction: Instruction) -> Translation:
    """Return an operation that firmware 1.05 does not know, and whose result is 0 in later ones."""
    if machine.dialect.has_fields:
        raise ProgramError(ERR_INSTR, "a negation of two values")
    target, left, right = (Place(argument) for argument in instruction.arguments)
    return lambda: aggregates.calculate(machine.data, lambda *_: 0, target, left, right)


def _unary(machine: Machine, instruction: Instruction) -> Translation:
    data, operands, operation = machine.data, machine.operands, scalars.unary(instruction.opcode)
    copies = aggregates.same_integers if machine.dialect.copies_arrays else aggregates.never
    target, source = (Place(argument) for argument in instruction.arguments)
    if instruction.opcode == scalars.NOT and operands.scalars(*instruction.arguments):
        operation = scalars.rounded_not
    symbol = {scalars.NEG: "-", scalars.NOT: "not "}.get(instruction.opcode)
    if symbol and all(kind in INTEGERS for kind in _kinds(machine, instruction)):
        value = f"{symbol}{operands.value(source.entry)}"
        if effect := operands.calculation(instruction.arguments, value, _FACTORS.get(instruction.opcode)):
            return effect
    whole = scalars.WHOLE.get(instruction.opcode)
    return _of_arrays(
        machine,
        instruction,
        lambda: aggregates.calculate_each(data, operation, target, source, copies_arrays=copies, whole=whole),
    )


def _compare(machine: Machine, instruction: Instruction) -> Translation:
    """Store whether a comparison holds; for arrays as a whole if the target is a number."""
    data, operands, relation = machine.data, machine.operands, instruction.flags
    target, left, right = (Place(argument) for argument in instruction.arguments)
    holds = COMPARISONS[relation]
    if operands.scalars(*instruction.arguments):
        condition = _comparison(machine, relation, left.entry, right.entry)
        if effect := operands.calculation(instruction.arguments, condition, limits=(0, 1)):
            return effect

    def each(kind: int, a: float, a_kind: int, b: float, b_kind: int) -> int:
        return int(holds(a, b) if kind == Type.FLOAT else holds(*comparable(a, a_kind, b, b_kind)))

    def run() -> None:
        if data.is_aggregate(target.entry) or data.is_aggregate(left.entry) != data.is_aggregate(right.entry):
            aggregates.calculate(data, each, target, left, right)
        else:
            try:
                holds = aggregates.compare(data, relation, left, right)
            except ProgramError:
                data.put(target.entry, int(relation in HOLD_FOR_EQUALS))
                raise
            data.put(target.entry, int(holds))

    return run


def _test(machine: Machine, instruction: Instruction) -> Translation:
    data, operands, holds = machine.data, machine.operands, COMPARISONS[instruction.flags]
    copies = aggregates.same_integers if machine.dialect.copies_arrays else aggregates.never
    target, value = (Place(argument) for argument in instruction.arguments)
    if operands.scalars(*instruction.arguments):
        condition = related(operands.value(value.entry), instruction.flags, "0")
        if effect := operands.calculation(instruction.arguments, condition, limits=(0, 1)):
            return effect

    def each(_: int, a: float, __: int) -> int:
        return int(holds(a, 0))

    return lambda: aggregates.calculate_each(data, each, target, value, copies_arrays=copies)


def _move(machine: Machine, instruction: Instruction) -> Translation:
    data, operands = machine.data, machine.operands
    target, source = (Place(argument) for argument in instruction.arguments)
    to, of = _kinds(machine, instruction)
    effect = None
    if operands.scalars(*instruction.arguments) and (of != Type.FLOAT or to == Type.FLOAT) and of != Type.VOID:
        effect = operands.calculation(instruction.arguments, operands.value(source.entry), (1, 0), _range(of))
    return effect or _of_arrays(machine, instruction, lambda: aggregates.move(data, target, source))


def _range(kind: int) -> tuple[int, int] | None:
    """Return the smallest and largest number of an unsigned type; None for others."""
    return (0, (1 << 8 * SIZES[kind]) - 1) if kind in (Type.UBYTE, Type.UWORD, Type.ULONG) else None


def _set(machine: Machine, instruction: Instruction) -> Translation:
    target, value = instruction.arguments
    if machine.dialect.signed_constants:
        kind = machine.data.kind(target)
        if kind == Type.FLOAT:
            return lambda: None
        value = s16(value) if kind in SIGNED else value
    effect = machine.operands.calculation([target], str(value), (value,), (value, value))
    return effect or (lambda: machine.data.put(target, value))


TABLE: Mapping[tuple[int, int], Translate] = {
    **{(opcode, 3): _binary for opcode in (*_SYMBOLS, scalars.DIV, scalars.MOD)},
    (scalars.NEG, 3): _negation_of_two,
    **{(opcode, 2): _unary for opcode in (scalars.NEG, scalars.NOT, scalars.SQRT, scalars.ABS)},
    (0x11, 3): _compare,
    (0x12, 2): _test,
    (0x1B, 2): _move,
    (0x1C, 2): _set,
}
"""Opcode and number of arguments to the function that translates it."""
