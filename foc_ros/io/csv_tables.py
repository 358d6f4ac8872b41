"""CSV tables of measured numbers, checked cell by cell: every error names file, row, column, value and bound."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from foc_ros.core.errors import RecordingError

FARTHEST_M = 1e4
"""Bound of coordinates and radii [m]; a larger one has a wrong unit or is in the wrong column."""
MAX_BYTES = 1_000_000_000
"""Size of a day of motion capture at 200 Hz."""


@dataclass(frozen=True)
class Row:
    """One line of a table, and its cells by column name."""

    file: Path
    line: int
    cells: dict[str, str]

    def read_number(self, column: str, low: float = -FARTHEST_M, high: float = FARTHEST_M, default: float | None = None) -> float:
        """Return a cell as a number in [low, high]; default: if the table does not have the column."""
        if column not in self.cells and default is not None:
            return default
        try:
            value = float(self.cells[column])
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise self.make_error(column, f'a number in [{low:.12g}, {high:.12g}]')
        return value

    def read_integer(self, column: str, low: int, high: int, default: int) -> int:
        """Return a cell as a whole number in [low, high]; default: if the table does not have the column."""
        value = self.read_number(column, low, high, default)
        if value != int(value):
            raise self.make_error(column, f'a whole number in [{low}, {high}]')
        return int(value)

    def make_error(self, column: str, expected: str) -> RecordingError:
        """Return the error of a cell."""
        return RecordingError(f'{self.file}: row {self.line}, column {column}: expected {expected}, got {self.cells[column]!r}')


def read_rows(
    file: Path, needed: tuple[str, ...], instead: Mapping[str, tuple[str, ...]] = MappingProxyType({})
) -> Iterator[Row]:
    """Yield the rows of a CSV file with a header; empty lines are skipped, and columns beside the needed ones are allowed.

    instead: columns that together replace a needed one.

    Raises RecordingError for a file that cannot be read, lacks a needed column or names one twice, and for a row with more or
    fewer cells than the header.
    """
    try:
        with file.open(newline='', encoding='utf-8-sig') as stream:
            if file.stat().st_size > MAX_BYTES:
                raise RecordingError(f'{file}: expected at most {MAX_BYTES:,} bytes, got {file.stat().st_size:,}')
            reader = csv.reader(stream, strict=True)
            header = _read_header(file, next(reader, []), needed, instead)
            for cells in reader:
                if any(cell.strip() for cell in cells):
                    if len(cells) != len(header):
                        raise RecordingError(f'{file}: row {reader.line_num}: expected {len(header)} cells, got {len(cells)}')
                    yield Row(file, reader.line_num, {name: cell.strip() for name, cell in zip(header, cells, strict=True)})
    except OSError as error:
        raise RecordingError(f'{file}: cannot be read: {error.strerror}') from error
    except UnicodeDecodeError as error:
        raise RecordingError(f'{file}: expected UTF-8 text, got byte {error.object[error.start]:#04x}') from error
    except csv.Error as error:
        raise RecordingError(f'{file}: not a CSV table: {error}') from error


def _read_header(file: Path, cells: list[str], needed: tuple[str, ...], instead: Mapping[str, tuple[str, ...]]) -> list[str]:
    header = [name.strip() for name in cells]
    if not header:
        raise RecordingError(f'{file}: the file is empty: expected columns {", ".join(needed)}')
    missing = [name for name in needed if not any(set(kind) <= set(header) for kind in ((name,), instead.get(name, (name,))))]
    if missing:
        raise RecordingError(f'{file}: row 1: no column {", ".join(missing)}; it has {", ".join(header)}')
    if len(set(header)) < len(header):
        raise RecordingError(f'{file}: row 1: a column is named twice: {", ".join(header)}')
    return header
