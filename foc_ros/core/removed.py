# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Names that are no parameters: those of earlier versions, with what took their place, of groups, and misspelt ones."""

from __future__ import annotations

from collections.abc import Mapping

from .errors import ParameterError, guard_keywords, suggest
from .parameter import Parameter

RECORDINGS = 'how much recordings count is fixed'
REMOVED = {
    'duration.time_cost': 'durations follow Fitts law or are fixed, and their pace is learnt',
    'duration.min_time_to_go_s': 'it is 0.3 s',
    'duration.max_time_to_go_s': 'it is 10 s',
    'likelihood.spent_share': 'only the effort to go is compared',
    'likelihood.planning_spread': 'it is 1 until the pace of the operator is known from one movement, and then 0.3',
    'likelihood.beta_beyond': 'ways beyond the next row are equally likely to an operator who looks ahead',
    'likelihood.heading_bias': 'reaches that bend are learnt as recordings: experience.learning',
    'likelihood.adaptation': 'nothing is learnt from choices any more',
    'likelihood.hold_s': 'it is 0.2 s',
    'likelihood.smoothing_s': 'a likelihood changes by one in 0.15 s at most',
    'likelihood.margin': 'it is 0.15',
    'experience.prior_count': RECORDINGS,
    'experience.prior_count_beyond': RECORDINGS,
    'experience.prior_count_path': RECORDINGS,
    'experience.position_stddev': RECORDINGS,
    'experience.velocity_stddev': RECORDINGS,
    'scene.height_stddevs': 'it is 2',
    'foc.algorithm1_delta': 'it is foc.lv_delta',
    'foc.algorithm1_xi': 'it is 1 m^2/s^6, as in the paper',
    'guidance.precision_low': 'it is 100 1/m^2',
    'guidance.precision_high': 'it is 2500 1/m^2',
    'guidance.position_stddev': 'it is 2 mm',
    'guidance.sharpness': 'a force has the size of its expected benefit',
    'guidance.yield_acceleration': 'the acceleration of the hand is evidence of what the operator wants',
}
"""By dotted name, a sentence that goes on after `it was removed: `."""


def find_parameter(name: str, value: object, known: Mapping[str, Parameter]) -> Parameter:
    """Return the parameter of a name; raise ParameterError for a name that is unknown or that of a group."""
    if name in known:
        return known[name]
    if name in REMOVED:
        raise ParameterError(name, f'no value, because it was removed: {REMOVED[name]}', repr(value))
    groups = {each.partition('.')[0] for each in known if '.' in each}
    hint = suggest(name, [each for each in known if each.endswith(f'.{name}')], 0.0) or suggest(name, (*known, *groups))
    expected = 'a group of parameters' if name in groups else f'a known parameter{hint}'
    raise ParameterError(name, expected, repr(value))


def guard_parameters(group: type, known: Mapping[str, Parameter]) -> None:
    """Let the constructor of a group, or of `Config`, answer a keyword that is no parameter as `find_parameter` does."""
    prefix = group.__name__.removesuffix('Config').lower()
    guard_keywords(group, lambda name, value: find_parameter(f'{prefix}.{name}'.lstrip('.'), value, known))
