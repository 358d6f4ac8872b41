# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""CSV tables of measured numbers, checked cell by cell: every error names file, row, column, value and bound."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from foc_ros.core.errors import FocError, RecordingError, collect, collect_all, join_errors, suggest
from foc_ros.core.support import FARTHEST

MAX_BYTES = 1_000_000_000
"""Size of a day of motion capture at 200 Hz."""
MOST_ERRORS = 100
"""Wrong rows after which a table is not read further."""
SEPARATORS = (',', ';', '\t', '|', ' ')
"""What may stand between two cells; with another one than the comma, a number may have a decimal comma."""


class Column(NamedTuple):
    """A column of numbers in [low, high]; default: the value in a table without the column, None where it is needed."""

    name: str
    low: float = -FARTHEST
    high: float = FARTHEST
    default: float | None = None


@dataclass(frozen=True)
class Row:
    """One line of a table, its cells by column name, and the decimal mark of its numbers, in addition to the point."""

    file: Path
    line: int
    cells: dict[str, str]
    decimal_mark: str = '.'

    def read_numbers(self, *columns: Column) -> list[float]:
        """Return the cells of some columns; raises RecordingError, with a note for every further wrong cell."""
        return collect_all(self._read_number, [(each,) for each in columns])

    def _read_number(self, column: Column) -> float:
        if column.name not in self.cells and column.default is not None:
            return column.default
        value = self.parse_number(column.name)
        if not column.low <= value <= column.high:
            hint = ' with a decimal point' if self.decimal_mark == '.' and ',' in self.cells[column.name] else ''
            raise self.make_error(column.name, f'a number{hint} in [{column.low:.12g}, {column.high:.12g}]')
        return value

    def parse_number(self, column: str) -> float:
        """Return a cell as a number, NaN where it is none."""
        text = self.cells.get(column, '').replace(self.decimal_mark, '.')
        try:
            return math.nan if '_' in text else float(text)
        except ValueError:
            return math.nan

    def read_integer(self, column: str, low: int, high: int, default: int) -> int:
        """Return a cell as a whole number in [low, high]; default: if the table does not have the column."""
        value = self.parse_number(column) if column in self.cells else float(default)
        if not low <= value <= high or value != int(value):
            raise self.make_error(column, f'a whole number in [{low}, {high}]')
        return int(value)

    def read_name(self, column: str) -> str:
        """Return a cell that may not be empty; an empty text if the table does not have the column."""
        if self.cells.get(column) == '':
            raise self.make_error(column, 'a name')
        return self.cells.get(column, '')

    def make_error(self, column: str, expected: str) -> RecordingError:
        """Return the error of a cell."""
        return RecordingError(f'{self.file}: row {self.line}, column {column}: expected {expected}, got {self.cells[column]!r}')


def parse_rows(rows: Iterable[Row], parse: Callable[[Row], None]) -> None:
    """Call a function with every row; raise one RecordingError for all rows for which it does so."""
    errors: list[FocError] = []
    try:
        for row in rows:
            collect(errors, parse, row)
            if len(errors) == MOST_ERRORS:
                errors.append(RecordingError(f'{row.file}: the rows after row {row.line} were not checked'))
                break
    except RecordingError as error:  # of the file itself
        errors.append(error)
    if errors:
        raise join_errors(errors)


def read_rows(
    file: Path,
    needed: tuple[str, ...],
    optional: tuple[str, ...] = (),
    instead: Mapping[str, tuple[str, ...]] = MappingProxyType({}),
) -> Iterator[Row]:
    """Yield the rows of a CSV file with a header; empty lines are skipped, and other columns are allowed.

    The separator is found in the header, before which a spreadsheet may name it (`sep=;`). optional: columns that may be missing;
    instead: columns that together replace a needed one. Raises RecordingError for a file that cannot be read, for a wrong header,
    and after the last row for rows with more or fewer cells than that.
    """
    try:
        with file.open(newline='', encoding='utf-8-sig') as stream:
            if file.stat().st_size > MAX_BYTES:
                raise RecordingError(f'{file}: expected at most {MAX_BYTES:,} bytes, got {file.stat().st_size:,}')
            first = next((line for line in stream if line.strip() and not line.startswith('sep=')), '')
            names = {*needed, *optional}  # the separator is that with which the header has the most of them
            separator = max(SEPARATORS, key=lambda each: len({cell.strip(' "\r\n') for cell in first.split(each)} & names))
            decimal_mark = '.' if separator == ',' else ','
            reader = csv.reader(chain([first], stream), delimiter=separator, skipinitialspace=True, strict=True)
            header = _check_header(file, next(reader, []), needed, optional, instead)
            errors: list[RecordingError] = []
            for cells in reader:
                if len(errors) == MOST_ERRORS:
                    break
                if not any(cell.strip() for cell in cells):
                    continue
                if len(cells) == len(header):
                    named = {name: cell.strip() for name, cell in zip(header, cells, strict=True)}
                    yield Row(file, reader.line_num, named, decimal_mark)
                    continue
                hint = ' (are there decimal commas? then separate the cells by semicolons)' if len(cells) > len(header) else ''
                words = f'expected {len(header)} cells, got {len(cells)}{hint}'
                errors.append(RecordingError(f'{file}: row {reader.line_num}: {words}'))
            if errors:
                raise join_errors(errors)
    except OSError as error:
        raise RecordingError(f'{file}: cannot be read: {error.strerror}') from error
    except UnicodeDecodeError as error:
        raise RecordingError(f'{file}: expected UTF-8 text, got byte {error.object[error.start]:#04x}') from error
    except csv.Error as error:
        raise RecordingError(f'{file}: not a CSV table: {error}') from error


def _check_header(
    file: Path, cells: list[str], needed: tuple[str, ...], optional: tuple[str, ...], instead: Mapping[str, tuple[str, ...]]
) -> list[str]:
    header = [name.strip() for name in cells]
    if not header:
        raise RecordingError(f'{file}: the file is empty: expected columns {", ".join(needed)}')
    missing = [name for name in needed if not any(set(kind) <= set(header) for kind in ((name,), instead.get(name, (name,))))]
    if missing:
        raise RecordingError(f'{file}: row 1: no column {", ".join(missing)}; it has {", ".join(header)}')
    named = [name for name in header if name]  # a spreadsheet adds empty columns
    if len(set(named)) < len(named):
        raise RecordingError(f'{file}: row 1: a column is named twice: {", ".join(header)}')
    absent = [name for name in optional if name not in header]
    # similar enough to be misspelt: `radius_stdev_m` is, `yaw_deg` is not
    hints = {name: suggest(name, absent, 0.8) for name in header if name not in (*needed, *optional)}
    if any(hints.values()):
        raise join_errors([RecordingError(f'{file}: row 1: unknown column {name}{hint}') for name, hint in hints.items() if hint])
    return header
