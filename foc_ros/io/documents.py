"""YAML and JSON files as mappings, lists and numbers: no tag is executed, and a key that is given twice is an error."""

from __future__ import annotations

import json
from collections.abc import Hashable, Iterable
from pathlib import Path
from typing import Any

import yaml

from foc_ros.core.errors import RecordingError

MAX_BYTES = 5_000_000
"""Size beyond that of any scene or parameter file; the YAML parser takes half a minute for it."""


class _StrictLoader(yaml.SafeLoader):
    """Safe YAML; PyYAML itself uses the last value of a key that is given twice."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """Return the mapping; see :class:`yaml.SafeLoader`."""
        try:
            _check_keys(key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode))
        except ValueError as error:
            raise yaml.constructor.ConstructorError(None, None, str(error), node.start_mark) from error
        return super().construct_mapping(node, deep)


def read_document(file: Path) -> Any:
    """Return the content of a file, as JSON if its name ends in .json, else as YAML; RecordingError names place and reason."""
    is_json = file.suffix == '.json'
    try:
        with file.open('rb') as opened:
            held = opened.read(MAX_BYTES + 1)
        if len(held) > MAX_BYTES:
            raise RecordingError(f'{file}: expected at most {MAX_BYTES:,} bytes, got more')
        text = held.decode('utf-8')
        return json.loads(text, object_pairs_hook=_build_mapping) if is_json else yaml.load(text, _StrictLoader)  # noqa: S506
    except OSError as error:
        raise RecordingError(f'{file}: cannot be read: {error.strerror}') from error
    except (ValueError, RecursionError, yaml.YAMLError) as error:
        raise RecordingError(f'{file}: not a {"JSON" if is_json else "YAML"} file: {error}') from error


def _build_mapping(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    _check_keys(name for name, _ in pairs)
    return dict(pairs)


def _check_keys(names: Iterable[str]) -> None:
    seen = set()
    for name in names:
        if name in seen:
            raise ValueError(f'the key {name} is given twice')
        seen.add(name)
