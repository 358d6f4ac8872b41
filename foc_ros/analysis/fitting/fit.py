"""All parameters in turn: first those that need no prediction, then those that need replays, then the rest from one replay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from functools import partial

import numpy as np

from foc_ros.analysis.parallel import collect
from foc_ros.analysis.recordings import Recording
from foc_ros.core.config import Config, flatten, replace_values
from foc_ros.core.errors import RecordingError

from . import covariance_fit, likelihood_fit
from .comparison import compare_configs, find_worse_positions
from .duration_fit import fit_duration, fit_wait
from .estimates import Fit, clip_to_bounds
from .estimator_fit import fit_estimator, fit_fading
from .predictor_settings import fit_max_candidates, make_eta_settings, make_movement_settings, make_noise_settings
from .recorded_hand import RecordedHand, read_hand
from .setting_search import Replays, observe_by_motor_noise, sample_names, search_settings

PREDICTIONS = 10
"""About as many predictions are made in each recording, because neighbours say the same."""
MIN_FOLDS = 3
"""Recordings below which there is no cross-validation."""
UNSCALED: dict[str, object] = {'covariance.near': 1.0, 'covariance.far': 1.0}
"""A fit sets both factors to 1, because it fits the covariances that they multiply."""
BY_EXAMPLE = 'examples/plan_recovery'
"""Where tau and lambda of strategy `fixed` are fitted."""
LEARNT: dict[str, object] = {'likelihood.adaptation': 'none'}
"""What a fit switches off: choices are known from many movements, and learning them anew from a few makes them worse."""


def fit_parameters(recordings: Mapping[str, Recording], config: Config, executor: Executor, may_lower_eta: bool = False) -> Fit:
    """Fit all parameters to recordings; raises RecordingError where no recording can be used.

    may_lower_eta: whether obstacles may be avoided with less certainty than the configuration wants.
    """
    fit = Fit(config)
    hands = _read_hands(recordings, fit, executor)
    usable = {each.name: recordings[each.name] for each in hands}
    fit.take(*fit_estimator(hands, fit.config))
    fit.take(*fit_fading(hands, fit.config))
    fit.take(*fit_duration(hands, fit.config))
    fit.take(fit_wait(hands, fit.config))
    fit.take(*fit_max_candidates(hands, fit.config))
    if config.foc.strategy == 'fixed':
        fit.warnings.append(f'foc.tau, foc.lam: kept as they are; {BY_EXAMPLE} finds them from movements')
    duration_s = float(np.median([each.times[-1] for each in hands]))
    rate_hz = clip_to_bounds('rate_hz', min(config.rate_hz, PREDICTIONS / max(duration_s, 1e-3)))
    thinned = {'rate_hz': rate_hz, 'covariance.adaptation': 'none'}
    _search(hands, fit, Replays(usable, thinned | UNSCALED, executor), may_lower_eta)
    _fit_to_one_replay(usable, fit, thinned | UNSCALED, executor)
    given, decided = flatten(config), UNSCALED | LEARNT
    fit.chosen |= {name: str(value) for name, value in decided.items() if given[name] != value}
    fit.config = replace_values(fit.config, decided)
    compared = {name: usable[name] for name in sample_names(list(usable))}
    fit.comparison = compare_configs(compared, (config, fit.config), thinned, executor)
    fit.warnings[:0] = find_worse_positions(fit.comparison)
    return fit


def _search(hands: Sequence[RecordedHand], fit: Fit, replays: Replays, may_lower_eta: bool) -> None:
    """Fit the parameters that need replays."""
    if not any(len(each.obstacles) for each in hands):
        fit.warnings.append(
            'foc.eta, foc.noise_x, foc.noise_y: no recording has an obstacle, and without one the recordings determine neither '
            'margins nor noise: they are kept'
        )
    elif fit.config.foc.strategy != 'fixed':
        # with strategy `fixed` eta has no effect, and lambda holds for the noise as it is
        search_settings('noise', make_noise_settings(fit.config), replays, fit)
        search_settings('eta', make_eta_settings(fit.config, may_lower_eta), replays, fit)
        if not may_lower_eta:
            fit.warnings.append('foc.eta: values below the given one were not tried; --allow eta tries them')
    search_settings('movement', make_movement_settings(hands, fit.config), replays, fit)


def _read_hands(recordings: Mapping[str, Recording], fit: Fit, executor: Executor) -> list[RecordedHand]:
    hands, failed = collect(partial(read_hand, config=fit.config), list(recordings.items()), executor, 'read')
    fit.failed.update(failed)
    if not hands:
        raise RecordingError(f'no recording can be used: {"; ".join(f"{name}: {why}" for name, why in fit.failed.items())}')
    fit.recordings = len(hands)
    return hands


def _fit_to_one_replay(recordings: Mapping[str, Recording], fit: Fit, thinned: Mapping[str, object], executor: Executor) -> None:
    """Fit the likelihood and the widening of the covariance to one replay, and score them held out."""
    observed, failed = observe_by_motor_noise(recordings, replace_values(fit.config, thinned), executor, 'replay')
    fit.failed.update(failed)
    if not observed:
        raise RecordingError(f'nothing could be predicted: {"; ".join(failed.values())}')
    cross = len(observed) >= MIN_FOLDS
    table = likelihood_fit.tabulate_likelihoods(observed, fit.config, executor)
    if np.isnan(table.values).all():
        fit.warnings.append(
            'likelihood.beta: no recording has an obstacle to pass on one of two sides, or a second goal: it is kept'
        )
    else:
        fit.warnings.extend(likelihood_fit.warn_of_missed_classes(observed))
        columns = likelihood_fit.choose_form(table, [each.name for each in observed])
        fit.take(*likelihood_fit.estimate_likelihood(table, columns))
        fit.scores.update(likelihood_fit.score_classes(table, columns, observed, cross))
    densities = covariance_fit.tabulate_densities(observed, fit.config)
    fit.take(*covariance_fit.estimate_widening(densities))
    fit.scores.update(covariance_fit.score_positions(densities, fit.config, observed, cross))
    if not cross:
        fit.warnings.append(f'cross-validation: {len(observed)} recordings are too few, {MIN_FOLDS} are needed')
