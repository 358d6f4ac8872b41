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


# as for ROS and YAML 1.2, and not as for PyYAML, 1e-3, .5e2 and -.5 are numbers, while 1:30 and 1_0 are texts
NUMBERS = {
    'tag:yaml.org,2002:int': r'[-+]?(0b[01]+|0x[0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)$',
    'tag:yaml.org,2002:float': r'(?i)[-+]?(([0-9]+\.?[0-9]*|\.[0-9]+)e[-+]?[0-9]+|[0-9]+\.[0-9]*|\.[0-9]+|\.inf)$|\.nan$',
}
_StrictLoader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in rules if tag not in NUMBERS]
    for first, rules in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
for _tag, _pattern in NUMBERS.items():
    _StrictLoader.add_implicit_resolver(_tag, re.compile(_pattern), list('-+.0123456789'))


def read_document(file: Path) -> Any:
    """Return the content of a file, as JSON if its name ends in .json, else as YAML; RecordingError names place and reason."""
    is_json = file.suffix == '.json'
    try:
        with file.open('rb') as opened:
            held = opened.read(MAX_BYTES + 1)
        if len(held) > MAX_BYTES:
            raise RecordingError(f'{file}: expected at most {MAX_BYTES:,} bytes, got more')
        text = held.decode('utf-8-sig')
        return json.loads(text, object_pairs_hook=_build_mapping) if is_json else yaml.load(text, _StrictLoader)  # noqa: S506
    except OSError as error:
        raise RecordingError(f'{file}: cannot be read: {error.strerror}') from error
    except RecursionError as error:
        raise RecordingError(f'{file}: expected fewer mappings and lists within each other') from error
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
