"""Expressions of a program's variables, for the statements that its instructions are translated to."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from sim_backend.firmware.vm.data import Data, rounded
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
        return f"get({argument})" if cell is None else f"{SCALARS[cell[0]].format[-1]}[{cell[1]}]"

    def integer(self, argument: int) -> str:
        """Return the value of a scalar that must be an integer: a float is rounded."""
        value = self.value(argument)
        return f"rounded({value})" if self._data.kind(argument) == Type.FLOAT else value

    def assignment(self, target: int, value: str, low: int | None = None, high: int | None = None) -> str | None:
        """Return a statement that sets a scalar.

        Args:
            target: Its variable.
            value: Expression of the value; an integer, unless the variable is a float.
            low: The smallest that the value can be, if that is known.
            high: The largest that the value can be.

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
        code, mask = SCALARS[kind].format[-1], (1 << 8 * SCALARS[kind].size) - 1
        if kind == Type.FLOAT or (low is not None and high is not None and low >= 0 and high <= mask):
            return f"{code if kind == Type.FLOAT else code.upper()}[{cell[1]}] = {value}"
        return f"{code.upper()}[{cell[1]}] = ({value}) & {mask}"

    def _cell(self, argument: int) -> tuple[int, int] | None:
        """Return the type of a variable and its number among those of its size in the pool, if it has one."""
        if argument >= self._data.first_field or sys.byteorder != "little":
            return None
        kind = self._data.kind(argument)
        if kind not in _CELLS:
            return None
        cell, rest = divmod(self._data.memory.base + self._data.entry(argument).data, SCALARS[kind].size)
        return None if rest or (cell + 1) * SCALARS[kind].size > len(self._data.memory.pool) else (kind, cell)
