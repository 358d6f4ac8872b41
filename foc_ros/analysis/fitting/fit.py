"""All parameters in turn: what needs no prediction first, then what needs replays, then what one replay tells of the rest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from functools import partial
from typing import Any

import numpy as np

from foc_ros.analysis.evaluation.observations import Observations
from foc_ros.analysis.evaluation.recordings import Recording
from foc_ros.analysis.evaluation.workers import collected
from foc_ros.core.config import Config, updated
from foc_ros.core.errors import RecordingError

from . import choices, doubts
from .demonstrations import Demonstration, demonstration
from .duration_fit import fit_duration
from .estimates import bounded
from .estimator_fit import fit_estimator
from .fading_fit import fit_fading
from .followed import fit_followed
from .found import Fit
from .movements import etas, movements, noises
from .plans import Reach, reach
from .recovery import fit_plans
from .replays import Replays, observed
from .search import search
from .wait_fit import fit_wait

PREDICTIONS = 10
"""About as many predictions are made in each recording: neighbours tell the same."""
FEWEST = 3
"""Recordings below which there is no cross-validation."""


def fit(recordings: Mapping[str, Recording], config: Config, executor: Executor) -> Fit:
    """Fit everything to recordings; raises RecordingError where none can be used."""
    found = Fit(config)
    demonstrations = _read(recordings, found, executor)
    usable = {each.name: recordings[each.name] for each in demonstrations}
    found.take(fit_estimator(demonstrations, found.config))
    found.take(fit_fading(demonstrations, found.config))
    found.take(fit_duration(demonstrations, found.config))
    found.take(fit_wait(demonstrations, found.config))
    found.take(fit_followed(demonstrations, found.config))
    if config.foc.strategy == 'fixed':
        found.take(fit_plans(_reaches(demonstrations, found), found.config))
    thin = _thin(demonstrations, config)
    _search(demonstrations, found, Replays(usable, thin, executor))
    _choose(usable, found, thin, executor)
    return found


def _search(demonstrations: Sequence[Demonstration], found: Fit, replays: Replays) -> None:
    """Fit what needs replays."""
    if not any(len(each.obstacles) for each in demonstrations):
        found.warnings.append(
            'foc.eta, foc.noise_x, foc.noise_y: no recording has an obstacle, and without one neither margins nor '
            'what widens them can be told: they are kept'
        )
    elif found.config.foc.strategy != 'fixed':
        # with strategy `fixed` eta has no effect, and lambda was found for the noise as it is
        search('noise', noises(found.config), replays, found)
        search('eta', etas(found.config), replays, found)
    search('movement', movements(demonstrations, found.config), replays, found)


def _read(recordings: Mapping[str, Recording], found: Fit, executor: Executor) -> list[Demonstration]:
    read, failed = collected(partial(demonstration, config=found.config), list(recordings.items()), executor, 'read')
    found.failed.update(failed)
    if not read:
        raise RecordingError(f'no recording can be used: {"; ".join(f"{name}: {why}" for name, why in found.failed.items())}')
    found.recordings = len(read)
    return read


def _reaches(demonstrations: Sequence[Demonstration], found: Fit) -> list[Reach]:
    reaches = []
    for each in demonstrations:
        try:
            reaches.append(reach(each, found.config))
        except RecordingError as error:
            found.failed[each.name] = str(error)
    if not reaches:
        raise RecordingError(f'no movement reaches a goal: {"; ".join(found.failed.values())}')
    return reaches


def _thin(demonstrations: Sequence[Demonstration], config: Config) -> dict[str, float]:
    """Return the rate at which the recordings are replayed, as changed parameters."""
    duration_s = float(np.median([each.times[-1] for each in demonstrations]))
    return {'rate_hz': bounded('rate_hz', min(config.rate_hz, PREDICTIONS / max(duration_s, 1e-3)))}


def _choose(recordings: Mapping[str, Recording], found: Fit, thin: Mapping[str, float], executor: Executor) -> None:
    """Fit the likelihood and the doubt about plans to one replay, and score them held out."""
    observations, failed = observed(recordings, updated(found.config, thin), executor, 'replay')
    found.failed.update(failed)
    if not observations:
        raise RecordingError(f'nothing could be predicted: {"; ".join(failed.values())}')
    table, names = choices.choice_table(observations, found.config, executor), [each.name for each in observations]
    if np.isnan(table.values).all():
        found.warnings.append(
            'likelihood.beta: no recording has an obstacle to pass on one of two sides, or a second goal: it is kept'
        )
    else:
        found.warnings.extend(choices.unheard(observations))
        columns = choices.plain_or_ahead(table, names)
        found.take(choices.likelihood_estimates(table, columns))
        found.scores.update(_choice_scores(table, columns, observations))
    densities = doubts.density_table(observations, found.config)
    found.take((doubts.doubt_estimates(densities), []))
    found.scores.update(_position_scores(densities, found.config, observations))
    if len(observations) < FEWEST:
        found.warnings.append(f'cross-validation: {len(observations)} recordings are too few, {FEWEST} are needed')


def _choice_scores(table: choices.Table, columns: Sequence[int], observations: Sequence[Observations]) -> dict[str, Any]:
    names, took = [each.name for each in observations], choices.classes(observations)
    scores = {
        'uniform': choices.uniform(observations),
        'as given': table.values[:, 0],
        'fitted': table.values[:, table.best(columns)],
    }
    if len(names) >= FEWEST:
        scores['without the recording'] = table.held_out(columns, names)
        if len(set(took)) > 1:
            scores['without its way'] = table.held_out(columns, took)
    return {'ways': {name: float(np.nanmean(values)) for name, values in scores.items()}}


def _position_scores(table: choices.Table, config: Config, observations: Sequence[Observations]) -> dict[str, Any]:
    names, columns = [each.name for each in observations], list(range(len(table.settings)))
    cross = len(names) >= FEWEST
    scores = {'motor noise alone': table.values[:, 0], 'fitted': table.values[:, table.best(columns)]}
    if cross:
        scores['without the recording'] = table.held_out(columns, names)
    tried = doubts.doubts(table, names if cross else None)
    held = {name: doubts.coverage(observations, config, each) for name, each in tried.items()}
    return {
        'positions': {name: float(np.nanmean(values)) for name, values in scores.items()},
        **{kind: {name: each[kind] for name, each in held.items()} for kind in ('inside_90', 'inside_all_90')},
    }
