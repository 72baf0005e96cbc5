"""Repeat additions and subtractions many times at once.

A loop without branches that adds, subtracts, negates, copies and sets integers of one size is a matrix, and so are its
repeats: a power of that matrix, modulo the number of values that a variable can have.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

from sim_backend.firmware.vm.instructions import Effect, Translation

_BITS = {"b": 8, "h": 16, "i": 32}
_MOST_VARIABLES = 4
"""Largest number of variables of a loop; with more, its repeats are as fast one by one."""

Rows = tuple[tuple[int, ...], ...]


class Repeated(NamedTuple):
    """Repeats of a loop.

    Attributes:
        rows: Of each variable and of 1, the factors of all of them after one repeat.
        changed: Which of the variables change.
        cells: The numbers of the variables' cells.
        code: The type code of all of them, see `Cell`.
    """

    rows: Rows
    changed: tuple[int, ...]
    cells: tuple[int, ...]
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


def linear(path: Sequence[Translation]) -> Repeated | None:
    """Return the effect of a loop of some instructions; None if it is not of this kind."""
    sums = [(each.cells, each.factors) for each in path if isinstance(each, Effect) and each.cells and each.factors]
    cells = sorted({cell for of_one, _ in sums for cell in of_one})
    codes = {cell.code for cell in cells}
    if len(sums) < len(path) or len(codes) != 1 or not codes <= _BITS.keys() or len(cells) > _MOST_VARIABLES:
        return None
    rows = list(_identity(len(cells) + 1))
    for (target, *sources), factors in sums:
        terms = [*(rows[cells.index(source)] for source in sources), rows[-1]]
        rows[cells.index(target)] = tuple(
            sum(factor * part for factor, part in zip(factors, parts, strict=True))
            for parts in zip(*terms, strict=True)
        )
    changed = tuple(sorted({cells.index(target) for (target, *_), _ in sums}))
    return Repeated(tuple(rows), changed, tuple(cell.number for cell in cells), codes.pop())


def _identity(size: int) -> Rows:
    return tuple(tuple(int(row == column) for column in range(size)) for row in range(size))


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
