"""Expressions of a program's variables, for the statements that its instructions are translated to."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import Any

from sim_backend.firmware.vm.data import Data, rounded
from sim_backend.firmware.vm.instructions import Cell, Effect, Ports
from sim_backend.firmware.vm.numbers import SCALARS
from sim_backend.firmware.vm.rxe import Type

INTEGERS = (Type.UBYTE, Type.SBYTE, Type.UWORD, Type.SWORD, Type.ULONG, Type.SLONG)
_CELLS = (*INTEGERS, Type.FLOAT)


class Operands:
    """Expressions of the variables of one program.

    Attributes:
        names: The values of the names in the expressions.
        written: The places in the pool that statements of `assignment` write to: the first, and the end of the last.
    """

    def __init__(self, data: Data) -> None:
        self._data = data
        memory = memoryview(data.memory.pool)
        self.names: dict[str, Any] = {code: memory.cast(code) for code in "BbHhIif"}  # type: ignore[call-overload]
        whole = len(memory) // 8 * 8
        self.names["keys"] = {shift: memory[shift : whole - 8 + shift].cast("Q") for shift in range(0, 8, 2)}
        self.names.update(memory=data.memory, pool=data.memory.pool, get=data.get, put=data.put, rounded=rounded)
        self.written = (len(data.memory.pool), 0)

    def function(self, name: str, function: Callable[..., object]) -> str:
        """Give a function a name; return that."""
        self.names[name] = function
        return name

    def scalars(self, *arguments: int) -> bool:
        """Return whether no variable is an array or a cluster."""
        return not any(self._data.is_aggregate(argument) for argument in arguments)

    def value(self, argument: int) -> str:
        """Return the value of a scalar."""
        cell = self._cell(argument)
        return f"{SCALARS[self._data.kind(argument)].format[-1]}[{cell.number}]" if cell else f"get({argument})"

    def integer(self, argument: int) -> str:
        """Return the value of a scalar that must be an integer: a float is rounded."""
        value = self.value(argument)
        return f"rounded({value})" if self._data.kind(argument) == Type.FLOAT else value

    def cells(self, arguments: Sequence[int]) -> tuple[Cell, ...] | None:
        """Return the cells of variables; None if one of them has none."""
        found = [cell for cell in map(self._cell, arguments) if cell]
        return tuple(found) if len(found) == len(arguments) else None

    def calculation(
        self,
        arguments: Sequence[int],
        value: str,
        factors: tuple[int, ...] | None = None,
        limits: tuple[int, int] | None = None,
    ) -> Effect | None:
        """Return the translation of an instruction that sets a scalar to a value that it calculates from others.

        Args:
            arguments: The variable that it sets, and those that it reads.
            value: See `assignment`.
            factors: See `Effect`.
            limits: See `assignment`.

        Returns:
            See `assignment`.
        """
        statement, cells = self.assignment(arguments[0], value, limits), self.cells(arguments)
        return Effect((statement,), Ports.NOTHING, cells=cells, factors=factors) if statement else None

    def assignment(self, target: int, value: str, limits: tuple[int, int] | None = None) -> str | None:
        """Return a statement that sets a scalar.

        Args:
            target: Its variable.
            value: Expression of the value; an integer, unless the variable is a float.
            limits: The smallest and the largest that the value can be, if that is known.

        Returns:
            None if the target is the field of a port, which would have further effects.
        """
        if target >= self._data.first_field:
            return None
        kind = self._data.kind(target)
        if kind in SCALARS:
            at = self._data.memory.base + self._data.entry(target).data
            self.written = min(self.written[0], at), max(self.written[1], at + SCALARS[kind].size)
        cell = self._cell(target)
        if cell is None:
            return f"put({target}, {value})"
        if kind == Type.FLOAT:
            return f"f[{cell.number}] = {value}"
        code, mask = cell.code.upper(), (1 << 8 * SCALARS[kind].size) - 1
        if limits and limits[0] >= 0 and limits[1] <= mask:
            return f"{code}[{cell.number}] = {value}"
        return f"{code}[{cell.number}] = ({value}) & {mask}"

    def _cell(self, argument: int) -> Cell | None:
        if argument >= self._data.first_field or sys.byteorder != "little":
            return None
        kind = self._data.kind(argument)
        if kind not in _CELLS:
            return None
        code, size = SCALARS[kind].format[-1].lower(), SCALARS[kind].size
        number, rest = divmod(self._data.memory.base + self._data.entry(argument).data, size)
        return None if rest or (number + 1) * size > len(self._data.memory.pool) else Cell(code, number)
