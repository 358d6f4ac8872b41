"""The settings of the predictor that a fit tries by replays, and the number of candidates that recordings need.

Noise and eta are tried one after the other. Where a goal that is passed is modelled as one where the hand stops, no duration is
right, nor where an acceleration that lasts is modelled as one that fades. So these are tried in all combinations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np

from foc_ros.analysis.evaluation.ground_truth import find_open_gaps
from foc_ros.core.classes.rows import find_direction, find_rows, locate_rows
from foc_ros.core.config import ARRIVALS, Config, flatten, replace_values

from .duration_fit import CONSTANTS, fit_other_models
from .estimates import Estimate, Estimates, clip_to_bounds
from .recorded_hand import RecordedHand

NOISES, DURATIONS = (0.06, 0.25, 2.0), (0.7, 1.4, 2.0)
"""Factors tried beside 1."""
ETAS = (0.7, 0.5, 0.95)
CANDIDATES = 'homotopy.max_candidates'
MAX_CLASSES = 24
"""Most path classes that make room for candidates; goals do beyond it. A prediction takes a few ms for each candidate."""


def make_noise_settings(config: Config) -> list[Config]:
    """Return the configuration, and it with other noise."""
    return [config, *(_scale(config, {'foc.noise_x': 1.0, 'foc.noise_y': 1.0}, factor) for factor in NOISES)]


def make_eta_settings(config: Config, may_be_lower: bool) -> list[Config]:
    """Return the configuration, and it with other probabilities of avoiding; may_be_lower: than the given one."""
    etas = [eta for eta in ETAS if may_be_lower or eta > config.foc.eta]
    return list(dict.fromkeys([config, *(replace_values(config, {'foc.eta': eta}) for eta in etas)]))


def make_movement_settings(hands: Sequence[RecordedHand], config: Config) -> list[Config]:
    """Return every combination of model, duration, arrival and whether accelerations fade, the given one first."""
    models = [config, *fit_other_models(hands, config)]
    scaled = [_scale(each, CONSTANTS[each.duration.model], factor) for each, factor in product(models, (1.0, *DURATIONS))]
    arrivals = dict.fromkeys([config.duration.arrival, *ARRIVALS])
    fading_times = dict.fromkeys([config.estimator.acceleration_time_s, 0.0])
    return [
        replace_values(each, {'duration.arrival': arrival, 'estimator.acceleration_time_s': fading_s})
        for each, arrival, fading_s in product(scaled, arrivals, fading_times)
    ]


def fit_max_candidates(hands: Sequence[RecordedHand], config: Config) -> tuple[Estimates, list[str]]:
    """Return the number of candidates that has room for every goal and path class, never less than the given one."""
    classes, goals = max(count_classes(each, config.scene.hand_radius) for each in hands), max(len(each.goals) for each in hands)
    given = config.homotopy.max_candidates
    count = int(clip_to_bounds(CANDIDATES, max(given, min(classes, MAX_CLASSES), goals)))
    warnings = [f'{CANDIDATES}: a recording has {classes} homotopy classes, {count} are followed'] if classes > count else []
    if count == given:
        return {}, warnings
    return {CANDIDATES: Estimate(CANDIDATES, count, count, count, 'classes and goals in the recordings')}, warnings


def count_classes(hand: RecordedHand, hand_radius: float = 0.0) -> int:
    """Return how many path classes lead a hand of a radius [m] through the rows between the start and the farthest goal."""
    start, obstacles = hand.positions[0], hand.obstacles
    direction = find_direction(start, hand.goals)
    row = find_rows(obstacles, direction, start, hand.goals)
    position = locate_rows(obstacles.centre @ direction, row)
    is_between = (position > start @ direction) & (position < (hand.goals @ direction).max())
    open_gaps = [len(each) for each in find_open_gaps(obstacles, row, direction, hand_radius)]
    return int(np.prod(np.array(open_gaps, dtype=float)[is_between]))


def _scale(config: Config, powers: Mapping[str, float], factor: float) -> Config:
    """Multiply each of the parameters by its power of a factor."""
    before = flatten(config)
    return replace_values(
        config, {name: clip_to_bounds(name, factor**power * float(before[name])) for name, power in powers.items()}
    )
