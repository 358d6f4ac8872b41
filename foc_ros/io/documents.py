# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""YAML and JSON files as mappings, lists and numbers: no tag is executed, and a key that is given twice is an error."""

from __future__ import annotations

import json
import re
from collections.abc import Hashable, Iterable
from pathlib import Path
from typing import Any

import yaml

from foc_ros.core.errors import RecordingError

MAX_BYTES = 5_000_000
"""Size beyond that of any scene or parameter file; the YAML parser takes half a minute for it."""
MAX_DEPTH = 20
"""Mappings and lists within each other; the deepest file, a parameter file with quality of service, needs six."""


class _StrictLoader(yaml.SafeLoader):
    """Safe YAML without tags, without a key that is given twice, and without aliases, which can stand for any amount of data."""

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Return the next node; see :class:`yaml.SafeLoader`."""
        event = self.peek_event()  # type: ignore[no-untyped-call]
        if isinstance(event, yaml.AliasEvent) or getattr(event, 'tag', None) is not None:
            words = 'tags (!name) and aliases (*name) are not supported'
            raise yaml.composer.ComposerError(None, None, words, event.start_mark)
        return super().compose_node(parent, index)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """Return the mapping; see :class:`yaml.SafeLoader`."""
        try:
            if any(key.tag == 'tag:yaml.org,2002:merge' for key, _ in node.value):
                raise ValueError('merging (<<) is not supported')
            _check_keys(key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode))
        except ValueError as error:
            raise yaml.constructor.ConstructorError(None, None, str(error), node.start_mark) from error
        return super().construct_mapping(node, deep)

    def construct_yaml_int(self, node: yaml.ScalarNode) -> Any:
        """Return the number; `1:30` and `1_0` remain texts, as they are for ROS and YAML 1.2."""
        return super().construct_yaml_int(node) if not set(':_') & set(node.value) else node.value

    def construct_yaml_float(self, node: yaml.ScalarNode) -> Any:
        """Return the number; `1:30.0` and `1_0.0` remain texts, too."""
        return super().construct_yaml_float(node) if not set(':_') & set(node.value) else node.value


_StrictLoader.add_constructor('tag:yaml.org,2002:int', _StrictLoader.construct_yaml_int)
_StrictLoader.add_constructor('tag:yaml.org,2002:float', _StrictLoader.construct_yaml_float)
# as for ROS, and YAML 1.2, 1e-3, .5e2 and -.5 are numbers; for PyYAML only 1.0e-3, .5e+2 and -0.5 are
_NUMBER = re.compile(r'[-+]?([0-9]+\.?|[0-9]*\.[0-9]+)e[-+]?[0-9]+$|[-+]\.[0-9]+$', re.IGNORECASE)
_StrictLoader.add_implicit_resolver('tag:yaml.org,2002:float', _NUMBER, list('-+.0123456789'))


def read_document(file: Path) -> Any:
    """Return the content of a file, as JSON if its name ends in .json, else as YAML; RecordingError names place and reason."""
    is_json = file.suffix == '.json'
    try:
        with file.open('rb') as opened:
            held = opened.read(MAX_BYTES + 1)
        if len(held) > MAX_BYTES:
            raise RecordingError(f'{file}: expected at most {MAX_BYTES:,} bytes, got more')
        text = held.decode('utf-8-sig')
        document = json.loads(text, object_pairs_hook=_build_mapping) if is_json else yaml.load(text, _StrictLoader)  # noqa: S506
        _check_depth(document)
        return document
    except OSError as error:
        raise RecordingError(f'{file}: cannot be read: {error.strerror}') from error
    except RecursionError as error:
        raise RecordingError(f'{file}: expected at most {MAX_DEPTH} mappings and lists within each other, got more') from error
    except (ValueError, yaml.YAMLError) as error:
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


def _check_depth(value: object, left: int = MAX_DEPTH) -> None:
    if isinstance(value, (dict, list)):
        if not left:
            raise RecursionError
        for each in value.values() if isinstance(value, dict) else value:
            _check_depth(each, left - 1)
