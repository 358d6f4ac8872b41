"""Settings chosen by log-likelihood, and cross-validation: each recording is scored with the setting best for the others.

Every setting is tried on every recording once. What a recording says about itself therefore never helps it.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.types import Array

from .baselines import Baseline
from .questions import Questions


def compute_log_likelihoods(questions: Questions, baseline: Baseline) -> Array:
    """Return the sum of the log-likelihoods of the true answers under each setting of a predictor, (s,)."""
    return np.array(
        [
            sum(np.log([baseline.forecast(*each, setting).true_probability(each[1]) for each in questions]))
            for setting in baseline.settings
        ]
    )


def choose_held_out(table: Array, groups: Sequence[Hashable]) -> NDArray[np.intp]:
    """Choose for each recording the setting (r,) that is best for the recordings of all other groups, the first of equal ones.

    table (r, s): log-likelihoods of recordings under settings; groups: the group of each recording. Where each is its own group,
    this is leave-one-out cross-validation. A single group has no others, and all recordings are used.
    """
    rows = {group: [row for row, each in enumerate(groups) if each == group] for group in groups}
    total = table.sum(axis=0)
    best = {group: int((total - table[own].sum(axis=0) if len(rows) > 1 else total).argmax()) for group, own in rows.items()}
    return np.array([best[group] for group in groups], dtype=np.intp)
