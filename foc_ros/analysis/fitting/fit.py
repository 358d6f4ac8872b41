# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""All parameters in turn, the given and the fitted ones compared, and the result as plain values and tables.

First come the parameters that need no prediction, then those that need replays, then the rest from one replay.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from foc_ros.analysis.evaluation.baselines import Forecast
from foc_ros.analysis.evaluation.observations import GAP, ObservedRecording, ask_all, ask_main, observe
from foc_ros.analysis.evaluation.positions import compute_position_scores
from foc_ros.analysis.evaluation.report import COVERAGE_LEVEL, COVERAGE_S, OURS
from foc_ros.analysis.evaluation.scores import FEW, FEWEST, find_mean, score_forecasts, warn_of_few
from foc_ros.analysis.evaluation.truth import RecordedHand, read_hand, warn_of_several_movements
from foc_ros.analysis.parallel import collect
from foc_ros.analysis.recordings import Recording
from foc_ros.core.config import Config, flatten, replace_values
from foc_ros.core.errors import RecordingError, warn
from foc_ros.io.terminal import name_stage

from . import STAGES, Findings, clip_to_bounds
from .direct import CONSTANTS, FADING, WAIT, fit_duration, fit_estimator, fit_fading, fit_wait
from .one_replay import LIKELIHOODS, TRIED_WIDENINGS, fit_likelihood, fit_widening
from .race import Replays, make_eta_settings, make_movement_settings, make_noise_settings, sample_names, search_settings

PREDICTIONS = 10
"""About as many predictions are made in each recording, because neighbours say the same."""
UNSCALED: dict[str, object] = {'covariance.near': 1.0, 'covariance.far': 1.0}
"""A fit sets both factors to 1, because it fits the covariances that they multiply."""
TOO_FEW = (
    f'only what the filter of the hand needs is fitted, as every sample shows it. All else keeps its given values: '
    f'{FEWEST} recordings are needed for an interval of 95 %, and {FEW} or more are better.'
)
COMPARISON_TITLES = {
    'class_gain': ('log-likelihood of the answer taken, above uniform [nat]', 1.0, 3),
    'gap_right': ('next gap correct [%]', 100.0, 1),
    'error_m 0.25': ('error of positions 0.25 s ahead [mm]', 1e3, 1),
    'error_m 0.5': ('error of positions 0.5 s ahead [mm]', 1e3, 1),
    'error_m 1': ('error of positions 1 s ahead [mm]', 1e3, 1),
    'nlpd': ('negative log-density of positions 0.5 s ahead [nat]', 1.0, 2),
    'inside_90': ('positions in the region of 90 %, 0.5 s ahead, also of hands at rest [%]', 100.0, 1),
}
"""Words, factor and digits of each measure."""
SCORE_TITLES = {
    'ways': 'log-likelihood of the path taken [nat]',
    'positions': 'log-density of true positions [nat]',
    'inside_90': 'positions of moving hands in the 90 % ellipse of the most likely candidate at 0.5 s',
    'inside_all_90': 'positions of moving hands in the 90 % region of all candidates at 0.5 s',
}
FROM_ONE_REPLAY = *LIKELIHOODS, *TRIED_WIDENINGS
FROM_MOVEMENTS = 'duration.arrival', WAIT, FADING, 'foc.noise_x', 'foc.noise_y', 'foc.eta', *FROM_ONE_REPLAY
"""Parameters to which one movement tells one thing, apart from the constants of durations."""
Rows = list[tuple[str, ...]]


@dataclass
class Fit(Findings):
    """The findings of all steps so far, and the configuration with them.

    comparison: of given and fitted parameters; stages: those of the `STAGES` that there are.
    """

    config: Config = field(default_factory=Config)
    recordings: int = 0
    failed: dict[str, str] = field(default_factory=dict)
    comparison: dict[str, dict[str, float | None]] = field(default_factory=dict)
    stages: Sequence[str] = STAGES

    def take(self, later: Findings) -> None:
        """Take what a later step found, also into the configuration."""
        super().take(later)
        self.config = replace_values(self.config, later.values)

    def name_stage(self, stage: str) -> str:
        """Return the words of a progress bar for a stage."""
        return name_stage(stage, self.stages)

    def keep(self, names: Iterable[str], count: int) -> None:
        """Leave parameters as they are because recordings, a number of them, are too few."""
        self.undetermined |= dict.fromkeys(names, f'too few recordings: {count}, {FEWEST} are needed')


def fit_parameters(recordings: Mapping[str, Recording], config: Config, may_lower_eta: bool = False) -> Fit:
    """Fit all parameters to recordings; raises RecordingError where no recording can be used.

    may_lower_eta: whether obstacles may be avoided with less certainty than the configuration wants.
    """
    fit = Fit(config=config)
    hands, fit.failed = collect(partial(read_hand, config=config), list(recordings.items()), 'read')
    if not hands:
        raise RecordingError(f'no recording can be used: {"; ".join(f"{name}: {why}" for name, why in fit.failed.items())}')
    fit.recordings, usable = len(hands), {each.name: recordings[each.name] for each in hands}
    fit.warnings += warn_of_several_movements((each.name, each.path) for each in hands)
    few = warn_of_few(len(hands), 'recordings')
    if len(hands) < FEWEST:
        few, fit.stages = [f'Too few recordings ({len(hands)}): {TOO_FEW}'], STAGES[-2:]
    for words in few:
        warn(words)
    fit.warnings += few
    if config.foc.strategy == 'fixed':
        fit.warnings.append('foc.tau, foc.lam: kept as they are; examples/plan_recovery finds them from movements')
    fit.take(fit_estimator(hands, config))
    duration_s = float(np.median([each.times[-1] for each in hands]))
    rate_hz = clip_to_bounds('rate_hz', min(config.rate_hz, PREDICTIONS / max(duration_s, 1e-3)))
    thinned = {'rate_hz': rate_hz, 'covariance.adaptation': 'none'}
    if len(hands) < FEWEST:
        fit.keep((*CONSTANTS[config.duration.model], *FROM_MOVEMENTS), len(hands))
    else:
        for step in (fit_fading, fit_duration, fit_wait):
            fit.take(step(hands, fit.config))
        _search(hands, fit, Replays(usable, thinned | UNSCALED), may_lower_eta)
        _fit_to_one_replay(usable, fit, thinned | UNSCALED)
    compared = {name: usable[name] for name in sample_names(list(usable))}
    fit.comparison = compare_configs(compared, (config, fit.config), thinned, fit.name_stage)
    fit.warnings[:0] = find_worse_positions(fit.comparison)
    return fit


def _search(hands: Sequence[RecordedHand], fit: Fit, replays: Replays, may_lower_eta: bool) -> None:
    """Fit the parameters that need replays."""
    has_obstacles = any(len(each.obstacles) for each in hands)
    if not has_obstacles:
        reason = 'no recording has an obstacle, without which neither margins nor noise show'
        fit.undetermined |= dict.fromkeys(('foc.eta', 'foc.noise_x', 'foc.noise_y'), reason)
    if not has_obstacles or fit.config.foc.strategy == 'fixed':
        # with strategy `fixed` eta has no effect, and lambda holds for the noise as it is
        fit.stages = STAGES[2:]
    else:
        fit.take(search_settings(fit.name_stage('noise'), make_noise_settings(fit.config), replays))
        fit.take(search_settings(fit.name_stage('eta'), make_eta_settings(fit.config, may_lower_eta), replays))
        if not may_lower_eta:
            fit.warnings.append('foc.eta: values below the given one were not tried; --allow eta tries them')
    fit.take(search_settings(fit.name_stage('movement'), make_movement_settings(hands, fit.config), replays))


def _fit_to_one_replay(recordings: Mapping[str, Recording], fit: Fit, thinned: Mapping[str, object]) -> None:
    """Fit the likelihood and the widening of the covariance to one replay, and score them held out."""
    config = replace_values(fit.config, thinned)
    predict = partial(observe, config=config, with_plans=True)
    observed, failed = collect(predict, list(recordings.items()), fit.name_stage('replay'))
    fit.failed.update(failed)
    if not observed:
        raise RecordingError(f'nothing could be predicted: {"; ".join(f"{name}: {why}" for name, why in failed.items())}')
    if len(observed) < FEWEST:
        fit.keep(FROM_ONE_REPLAY, len(observed))
        return
    given = flatten(fit.config)
    fit.take(fit_likelihood(observed, fit.config, fit.name_stage('likelihood')))
    fit.take(fit_widening(observed, fit.config))
    fit.chosen |= {name: str(value) for name, value in UNSCALED.items() if given[name] != value}
    fit.config = replace_values(fit.config, UNSCALED)


def compare_configs(
    recordings: Mapping[str, Recording],
    configs: tuple[Config, Config],
    thinned: Mapping[str, object],
    name_stage: Callable[[str], str],
) -> dict[str, dict[str, float | None]]:
    """Return the measures `COMPARISON_TITLES` of two configurations, `before` and `after`, from the recordings that both predict.

    thinned: parameters of these replays alone; name_stage: returns the words of a progress bar.
    """
    replays = []
    for config, stage in zip(configs, ('before', 'after'), strict=True):
        predict = partial(observe, config=replace_values(config, thinned))
        observed, _ = collect(predict, list(recordings.items()), name_stage(stage))
        replays.append({each.name: each for each in observed})
    common = [name for name in recordings if all(name in replay for replay in replays)]
    if not common:
        return {}
    before, after = (_measure([replay[name] for name in common]) for replay in replays)
    return {name: {'before': before[name], 'after': after[name]} for name in before}


def _measure(recordings: Sequence[ObservedRecording]) -> dict[str, float | None]:
    classes, gaps = (
        score_forecasts(
            (0, observation, question, Forecast.from_shares(observation.candidates.likelihood, question))
            for recording in recordings
            for observation, question in ask(recording)
        )
        for ask in (ask_main, partial(ask_all, name=GAP))
    )
    positions = compute_position_scores(recordings)
    return {
        'class_gain': find_mean(classes.log_likelihood + np.log(classes.possible)),
        'gap_right': find_mean(gaps.correct),
        **{f'error_m {horizon}': error for horizon, error in positions['displacement_m'][OURS]['final'].items()},
        'nlpd': positions['nlpd']['foc'][COVERAGE_S],
        'inside_90': positions['inside_all'][f'{COVERAGE_LEVEL:g}'][COVERAGE_S],
    }


def find_worse_positions(comparison: Mapping[str, Mapping[str, float | None]]) -> list[str]:
    """Return a sentence for each horizon at which the positions become worse, by 5 % and 1 mm."""
    errors = ((name.split()[1], each['before'], each['after']) for name, each in comparison.items() if name.startswith('error_m'))
    return [
        f'predicted positions {horizon} s ahead become worse with the fitted parameters: '
        f'from {1e3 * before:.0f} to {1e3 * after:.0f} mm'
        for horizon, before, after in errors
        if before is not None and after is not None and after > 1.05 * before + 0.001
    ]


def make_answer(fit: Fit, given: Config, output: Path) -> dict[str, Any]:
    """Return a fit as plain values; node: the commands that run the node with it, without and with a ROS installation."""
    before, options = flatten(given), f'--ros-args --params-file {output}'
    return {
        'recordings': fit.recordings,
        'failed': fit.failed,
        'parameters': {
            name: {'value': each.value, 'interval': [each.low, each.high], 'how': each.how, 'given': before[name]}
            for name, each in fit.estimates.items()
        },
        'chosen': {name: {'value': value, 'given': before[name]} for name, value in fit.chosen.items()},
        'undetermined': {name: {'given': before[name], 'why': why} for name, why in fit.undetermined.items()},
        'scores': fit.scores,
        'comparison': fit.comparison,
        'warnings': fit.warnings,
        'output': str(output),
        'node': [f'python -m foc_ros node {options}', f'ros2 run foc_ros foc_node {options}'],
    }


def format_parameters(answer: Mapping[str, Any]) -> Rows:
    """Return the rows of the parameters in an answer of `fit --json` that have new values."""
    rows: Rows = []
    for name, each in answer['parameters'].items():
        given, value, low, high = map(show_value, (each['given'], each['value'], *each['interval']))
        if value != given:
            rows.append((name, given, value, f'{low} to {high}', each['how']))
    for name, each in answer['chosen'].items():
        rows.append((name, show_value(each['given']), each['value'], '', 'predicted positions and paths'))
    return rows


def format_kept(answer: Mapping[str, Any]) -> Rows:
    """Return the rows of the parameters in an answer of `fit --json` that keep their values, with the reason."""
    rows: Rows = []
    for name, each in answer['parameters'].items():
        given, value, low, high = map(show_value, (each['given'], each['value'], *each['interval']))
        if value == given:
            rows.append((name, given, f'the best value tried, with an interval of 95 % from {low} to {high}: {each["how"]}'))
    for name, each in answer['undetermined'].items():
        rows.append((name, show_value(each['given']), each['why']))
    return rows


def show_value(value: object) -> str:
    """Return the value of a parameter as tables show it."""
    return f'{value:.3g}' if isinstance(value, float) else str(value)


def format_comparison(answer: Mapping[str, Any]) -> Rows:
    """Return the rows of the measures before and after a fit in an answer of `fit --json`, with a word for each change."""
    compared = answer['comparison'].items()
    return _judge((name, COMPARISON_TITLES[name], each['before'], each['after']) for name, each in compared)


def _judge(measures: Iterable[tuple[str, tuple[str, float, int], float | None, float | None]]) -> Rows:
    """Return a row for each measure by name, title, value before and value after; none where a value is not known."""
    rows: Rows = []
    for name, (words, factor, digits), before, after in measures:
        if before is None or after is None:
            continue
        shown = [f'{factor * value:.{digits}f}' for value in (before, after)]
        if name.startswith('inside'):
            is_better = after > before if min(before, after) < COVERAGE_LEVEL else after < before
        else:
            is_better = after < before if name.startswith(('error_m', 'nlpd')) else after > before
        rows.append((words, *shown, '' if shown[0] == shown[1] else 'better' if is_better else 'worse'))
    return rows


def make_verdict(answer: Mapping[str, Any]) -> list[str]:
    """Return sentences that say what a fit makes better, and what worse, on recordings held out first."""
    scores = answer['scores'].items()
    held_out = _judge((name, (SCORE_TITLES[name], 1.0, 3), each.get('as given'), each.get('held out')) for name, each in scores)
    found: dict[str, list[str]] = {}
    # only these parameters are fitted without the recording that they are scored on
    alone = 'recordings held out, by the likelihood and the widening alone'
    for where, rows in ((alone, held_out), ('the same recordings, with the fitted parameters', format_comparison(answer))):
        for change in ('better', 'worse'):
            found[f'{change.capitalize()} on {where}'] = [f'{row[0]} {row[1]} to {row[2]}' for row in rows if row[3] == change]
    judged = [f'{verdict}: {"; ".join(each)}.' for verdict, each in found.items() if each]
    return judged or ['The fitted parameters change no measure.']


def make_tables(answer: Mapping[str, Any]) -> Iterator[tuple[str, tuple[str, ...], Rows]]:
    """Yield title, columns and rows of the tables of an answer of `fit --json`."""
    scores: Rows = []
    for score, values in answer['scores'].items():
        settings: dict[str, list[str]] = {}  # those with the same value in one row
        for setting, value in values.items():
            settings.setdefault('-' if value is None else f'{value:.3f}', []).append(setting)
        scores += [(SCORE_TITLES[score], ', '.join(each), shown) for shown, each in settings.items()]
    tables = (
        ('Before and after', ('with the same recordings', 'before', 'after', ''), format_comparison(answer)),
        ('Parameters with new values', ('parameter', 'given', 'fitted', '95 %', 'data'), format_parameters(answer)),
        ('Parameters that keep their values', ('parameter', 'given', 'why'), format_kept(answer)),
        ('Scores of the likelihood and of the widening, all else being fitted', ('score', 'setting', 'value'), scores),
    )
    yield from (each for each in tables if each[2])


def make_sentences(answer: Mapping[str, Any]) -> list[str]:
    """Return the notes of an answer of `fit --json`, and what became better and worse."""
    return [*(f'note: {warning}' for warning in answer['warnings']), *make_verdict(answer)]


def list_commands(answer: Mapping[str, Any]) -> str:
    """Return the lines that say how the node is run with the parameters."""
    words = f'{answer["recordings"]} recordings; parameters written to {answer["output"]}. Run the node with them:'
    return '\n  '.join((words, *answer['node']))
