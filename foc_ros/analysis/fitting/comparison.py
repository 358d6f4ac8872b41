"""The given and the fitted parameters compared on the recordings: classes, positions and coverage before and after a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from functools import partial

import numpy as np

from foc_ros.analysis.evaluation.forecasts import Forecast, published_shares
from foc_ros.analysis.evaluation.observations import ObservedRecording, observe
from foc_ros.analysis.evaluation.position_metrics import compute_position_scores
from foc_ros.analysis.evaluation.questions import GAP, ask_all, ask_main
from foc_ros.analysis.evaluation.verdict import OURS
from foc_ros.analysis.parallel import collect
from foc_ros.analysis.recordings import Recording
from foc_ros.core.config import Config, replace_values

WORSE_SHARE, WORSE_M = 0.05, 0.001
"""Growth of an error of positions above which it is worse: a share of it, and a length [m]."""
SMALLER_IS_BETTER = ('error_m', 'nlpd')
"""Measures that begin with one of these are better if they are smaller."""


def compare_configs(
    recordings: Mapping[str, Recording], configs: tuple[Config, Config], thinned: Mapping[str, object], executor: Executor
) -> dict[str, dict[str, float | None]]:
    """Return the measures of two configurations, `before` and `after`, by measure, from the recordings that both predict.

    thinned: parameters of these replays alone. `class_gain`: log-likelihood of the answer taken above uniform [nat]; `gap_right`:
    share of correct next gaps; `error_m 0.5`: distance of the likelihood-weighted position from the true one 0.5 s ahead [m];
    `nlpd`: negative log-density of the true positions 0.5 s ahead [nat]; `inside_90`: their share in the region of 90 %.
    """
    items = list(recordings.items())
    replays = []
    for config, words in zip(configs, ('before', 'after'), strict=True):
        observed, _ = collect(partial(observe, config=replace_values(config, thinned)), items, executor, words)
        replays.append({each.name: each for each in observed})
    common = [name for name in recordings if all(name in replay for replay in replays)]
    if not common:
        return {}
    before, after = (_measure([replay[name] for name in common]) for replay in replays)
    return {name: {'before': before[name], 'after': after[name]} for name in before}


def find_worse_positions(comparison: Mapping[str, Mapping[str, float | None]]) -> list[str]:
    """Return a sentence for each horizon at which the positions become worse."""
    sentences = []
    for name, each in comparison.items():
        before, after = each['before'], each['after']
        if not name.startswith('error_m') or before is None or after is None:
            continue
        if after > before * (1.0 + WORSE_SHARE) + WORSE_M:
            horizon, change = name.split()[1], f'from {1e3 * before:.0f} to {1e3 * after:.0f} mm'
            sentences.append(f'predicted positions {horizon} s ahead become worse with the fitted parameters: {change}')
    return sentences


def _measure(recordings: Sequence[ObservedRecording]) -> dict[str, float | None]:
    gains, gaps = [], []
    for recording in recordings:
        for observation, question in ask_main(recording):
            forecast = Forecast.from_shares(published_shares(observation), question)
            gains.append(np.log(forecast.true_probability(question)) + np.log(question.possible))
        for observation, question in ask_all(recording, GAP):
            gaps.append(Forecast.from_shares(published_shares(observation), question).correctness(question))
    positions = compute_position_scores(recordings)
    return {
        'class_gain': float(np.mean(gains)) if gains else None,
        'gap_right': float(np.mean(gaps)) if gaps else None,
        **{f'error_m {horizon}': error for horizon, error in positions['displacement_m'][OURS]['final'].items()},
        'nlpd': positions['nlpd']['foc']['0.5'],
        'inside_90': positions['inside_all']['0.9']['0.5'],
    }
