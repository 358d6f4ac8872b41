# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Documents and messages by declared fields: models of pydantic, and its errors as sentences that name field, value and bound."""

from __future__ import annotations

import re
import reprlib
from collections.abc import Iterable, Mapping

from foc_ros.core.errors import FocError, suggest

try:
    from pydantic import BaseModel, ConfigDict, ValidationError, model_validator  # noqa: F401  version 1 has no model_validator
except ImportError as error:
    raise FocError("scene files and the page need pydantic of version 2: pip install 'pydantic>=2'") from error

EXPECTED = {
    'missing': 'a value',
    'json_invalid': 'JSON',
    'invalid_key': 'a name',
    'string_type': 'a text',
    'string_pattern_mismatch': 'a whole number, or a name of letters, digits, _ and ., of at most 40 characters',
    'list_type': 'a list',
    'tuple_type': 'a list',
    'model_type': 'a mapping of fields',
    'dict_type': 'a mapping of fields',
    'float_type': 'a number',
    'finite_number': 'a finite number',
    'greater_than_equal': 'a number >= {ge:g}',
    'less_than_equal': 'a number <= {le:g}',
    'too_short': 'a list of at least {min_length}',
    'too_long': 'a list of at most {max_length}',
}
"""What was expected, by the kind of an error whose own words are no part of a sentence."""


class Fields(BaseModel):
    """A mapping of exactly the declared fields, of exactly their types, and finite."""

    model_config = ConfigDict(extra='forbid', frozen=True, strict=True, allow_inf_nan=False)


def describe_errors(invalid: ValidationError, known: Mapping[str, Iterable[str]] | None = None) -> list[tuple[str, str, str]]:
    """Return for each error the field, what was expected, and what was found.

    The tag of a union is part of the name of a field, unless it is in brackets. known: names of fields by such a tag, '' for
    none.
    """
    found = []
    for each in invalid.errors(include_url=False):
        kind, parts = each['type'], [part for part in each['loc'] if not str(part).startswith('(')]
        tag = next((part for part in reversed(each['loc']) if str(part).startswith('(')), '')
        field = ''.join(f'[{part}]' if isinstance(part, int) else f'.{part[:40]}' for part in parts).lstrip('.')
        words = EXPECTED.get(kind, re.sub(r'^(Input|String) should (be|have) ', '', each['msg']))
        expected = words.format_map(each.get('ctx', {})) if kind in EXPECTED else words
        if kind == 'extra_forbidden':
            names = () if known is None else tuple(known[str(tag)])
            hint = suggest(parts[-1], names) or ': ' + ', '.join(names)
            expected = f'a known field{hint}' if names else 'no such field'
        got = 'nothing' if kind == 'missing' else reprlib.repr(each['input'])
        if kind == 'too_long' and each['ctx']['actual_length']:
            got = f'one of {each["ctx"]["actual_length"]}'
        found.append((field, expected, got))
    return found
