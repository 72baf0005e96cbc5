"""CSV files of measurements, for spreadsheets: one row per reading, each written at once."""

from __future__ import annotations

import argparse
import contextlib
import csv
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Self

from nxtdrive.cli.options import output_file
from nxtdrive.host.writing import writing

UNITS = {"mm": "mm", "%": "percent", "°C": "celsius", "°": "deg", "": ""}
"""Units as they are written in the names of columns."""


def add_csv_argument(parser: argparse.ArgumentParser) -> None:
    """Add ``--csv FILE``."""
    parser.add_argument(
        "--csv",
        metavar="FILE",
        type=output_file,
        help="also write each reading as a row of this CSV file, which is replaced",
    )


def column(quantity: str, unit: str) -> str:
    """Return the name of a column: ``distance_mm``."""
    return "_".join(part for part in (quantity, UNITS.get(unit, unit)) if part)


class CsvFile:
    """A CSV file; the first row replaces earlier contents, and its keys are the header.

    Raises:
        ConfigError: The file cannot be written; also raised by `write`.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        with writing(path):
            self._file = path.open("a", encoding="utf-8", newline="")
        self._rows: csv.DictWriter[str] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(OSError):  # the failure has been reported
            self._file.close()

    def write(self, row: Mapping[str, object]) -> None:
        """Write a row at once; True and False become 1 and 0, None an empty cell."""
        with writing(self._path):
            if self._rows is None:
                if os.path.isfile(self._path):  # not a device
                    self._file.truncate(0)
                self._rows = csv.DictWriter(self._file, list(row), lineterminator="\n")
                self._rows.writeheader()
            self._rows.writerow({name: int(value) if isinstance(value, bool) else value for name, value in row.items()})
            self._file.flush()
