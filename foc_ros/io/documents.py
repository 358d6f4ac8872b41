"""YAML and JSON files as plain mappings, lists and numbers; nothing in them is run, and no key hides another."""

from __future__ import annotations

import json
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml

from foc_ros.core.errors import RecordingError

MAX_BYTES = 5_000_000
"""Larger than any scene or parameter file; a YAML of it takes half a minute."""


class _StrictLoader(yaml.SafeLoader):
    """Safe YAML in which a key that is given twice is an error, not the last one wins."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """Return the mapping; see :class:`yaml.SafeLoader`."""
        names = [key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode)]
        for name in names:
            if names.count(name) > 1:
                raise yaml.constructor.ConstructorError(None, None, f'the key {name} is given twice', node.start_mark)
        return super().construct_mapping(node, deep)


def read_document(file: Path) -> Any:
    """Return what a file holds: JSON where its name ends in .json, else YAML.

    Raises RecordingError with file, place and reason.
    """
    try:
        with file.open('rb') as opened:
            held = opened.read(MAX_BYTES + 1)
        if len(held) > MAX_BYTES:
            raise RecordingError(f'{file}: expected at most {MAX_BYTES:,} bytes, got more')
        text = held.decode('utf-8')
        if file.suffix == '.json':
            return json.loads(text, object_pairs_hook=_once)
        return yaml.load(text, _StrictLoader)  # noqa: S506 (derives from SafeLoader)
    except OSError as error:
        raise RecordingError(f'{file}: cannot be read: {error.strerror}') from error
    except (ValueError, RecursionError, yaml.YAMLError) as error:
        raise RecordingError(f'{file}: not a {"JSON" if file.suffix == ".json" else "YAML"} file: {error}') from error


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    names = [name for name, _ in pairs]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f'the key {name} is given twice')
    return dict(pairs)
