"""Repeat additions and subtractions many times at once.

A loop without branches that adds, subtracts, negates, copies and sets integers of one size is a matrix, and so are its
repeats: a power of that matrix, modulo the number of values that a variable can have.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

_OPERAND = r"(-?(?:[bhi]\[\d+\]|\d+))"
_STATEMENT = re.compile(rf"([BHI])\[(\d+)\] = \(?{_OPERAND}(?: ([+-]) {_OPERAND})?\)?(?: & \d+)?", re.IGNORECASE)
_BITS = {"b": 8, "h": 16, "i": 32}
_MOST_VARIABLES = 4
"""Largest number of variables of a loop; with more, its repeats are as fast one by one."""

Rows = tuple[tuple[int, ...], ...]


class Repeated(NamedTuple):
    """Repeats of a loop.

    Attributes:
        rows: Of each variable and of 1, the factors of all of them after one repeat.
        changed: Which of the variables change.
        cells: The variables, without their type.
        code: Type of all of them, as `Operands` names it.
    """

    rows: Rows
    changed: tuple[int, ...]
    cells: tuple[str, ...]
    code: str

    def powers(self, times: int) -> tuple[int, ...]:
        """Return the factors after a number of repeats, in the order of `factors`."""
        rows = _power(self.rows, times, (1 << _BITS[self.code]) - 1)
        return tuple(factor for changed in self.changed for factor in rows[changed])

    @property
    def factors(self) -> str:
        """The names of the factors."""
        return ", ".join(f"f{row}_{column}" for row in self.changed for column in range(len(self.rows)))

    @property
    def statement(self) -> str:
        """A statement that changes the variables by the factors."""
        unsigned, mask = self.code.upper(), (1 << _BITS[self.code]) - 1
        sums = [
            " + ".join(
                [
                    *(f"f{row}_{column} * {unsigned}[{cell}]" for column, cell in enumerate(self.cells)),
                    f"f{row}_{len(self.cells)}",
                ]
            )
            for row in self.changed
        ]
        targets = ", ".join(f"{unsigned}[{self.cells[row]}]" for row in self.changed)
        return f"{targets} = {', '.join(f'({total}) & {mask}' for total in sums)}"


def linear(statements: Sequence[str]) -> Repeated | None:
    """Return the effect of a loop of some statements; None if it is not of this kind."""
    parts = [match.groups() for statement in statements if (match := _STATEMENT.fullmatch(statement))]
    cells = sorted({cell for _, target, one, _, other in parts for cell in (target, *_cells(one), *_cells(other))})
    codes = {code.lower() for part in parts for code in (part[0], *_codes(part[2]), *_codes(part[4]))}
    if not parts or len(parts) < len(statements) or len(codes) > 1 or len(cells) > _MOST_VARIABLES:
        return None
    size = len(cells) + 1
    rows = list(_identity(size))
    for _, target, one, sign, other in parts:
        left, right = _row(one, cells, rows), _row(other or "0", cells, rows)
        factor = -1 if sign == "-" else 1
        rows[cells.index(target)] = tuple(a + factor * b for a, b in zip(left, right, strict=True))
    changed = tuple(sorted({cells.index(part[1]) for part in parts}))
    return Repeated(tuple(rows), changed, tuple(cells), codes.pop())


def _cells(operand: str | None) -> list[str]:
    return re.findall(r"\[(\d+)\]", operand or "")


def _codes(operand: str | None) -> list[str]:
    return re.findall(r"[bhi]", operand or "", re.IGNORECASE)


def _identity(size: int) -> Rows:
    return tuple(tuple(int(row == column) for column in range(size)) for row in range(size))


def _row(operand: str, cells: Sequence[str], rows: Sequence[tuple[int, ...]]) -> tuple[int, ...]:
    """Return the factors of an operand, by those of the variables so far."""
    sign, number = (-1, operand[1:]) if operand.startswith("-") else (1, operand)
    found = _cells(number)
    row = rows[cells.index(found[0])] if found else tuple(int(number) * factor for factor in rows[-1])
    return tuple(sign * factor for factor in row)


@lru_cache(maxsize=4096)
def _power(rows: Rows, times: int, mask: int) -> Rows:
    if not times:
        return _identity(len(rows))
    half = _power(rows, times // 2, mask)
    square = _product(half, half, mask)
    return _product(square, rows, mask) if times % 2 else square


def _product(left: Rows, right: Rows, mask: int) -> Rows:
    columns = list(zip(*right, strict=True))
    return tuple(
        tuple(sum(a * b for a, b in zip(row, column, strict=True)) & mask for column in columns) for row in left
    )
