"""How unsure predictions are of their plans, from one replay: every doubt tried on every recording, as the likelihoods are."""

from __future__ import annotations

from collections.abc import Hashable, Sequence

import numpy as np

from foc_ros.analysis.evaluation.forecasts import power_rule
from foc_ros.analysis.evaluation.heldout import chosen
from foc_ros.analysis.evaluation.observations import TIMES_S, Observations
from foc_ros.analysis.evaluation.positions import held, mixture_levels
from foc_ros.core.config import Config

from .choices import Table
from .densities import DOUBTS, NO_DOUBT, Doubt, log_densities, widened
from .estimates import Estimate
from .resampling import CENTRAL

HORIZON_S, LEVEL = 0.5, 0.9


def density_table(observations: Sequence[Observations], config: Config) -> Table:
    """Try every doubt about the plans on every recording; none is the first."""
    rows = []
    for recording in observations:
        each = [log_densities(seen, power_rule(seen, config.likelihood), config, DOUBTS) for seen in recording.each]
        known = [row for row in each if row is not None]
        rows.append(np.mean(known, axis=0) if known else np.full(len(DOUBTS), np.nan))
    return Table(np.array(rows), DOUBTS)


def doubt_estimates(table: Table) -> dict[str, Estimate]:
    """Return the estimates of what makes predictions unsure of their plans."""
    columns = list(range(len(table.settings)))
    best, *drawn = (_doubt(table, place).parameters() for place in (table.best(columns), *table.resampled(columns)))
    estimates = {}
    for name, value in best.items():
        low, high = np.percentile([each[name] for each in drawn], CENTRAL)
        estimates[name] = Estimate(name, float(f'{value:.4g}'), float(low), float(high), 'density of true positions')
    return estimates


def _doubt(table: Table, place: int) -> Doubt:
    doubt = table.settings[place]
    assert isinstance(doubt, Doubt)
    return doubt


def doubts(table: Table, groups: Sequence[Hashable] | None) -> dict[str, list[Doubt]]:
    """Return, for each recording, no doubt, what is best for all, and, with groups, what is best for the other groups."""
    n = len(table.values)
    found = {'motor noise alone': [NO_DOUBT] * n, 'fitted': [_doubt(table, table.best(range(len(table.settings))))] * n}
    if groups is not None:
        found['without the recording'] = [_doubt(table, int(place)) for place in chosen(np.nan_to_num(table.values), groups)]
    return found


def coverage(observations: Sequence[Observations], config: Config, doubts: Sequence[Doubt]) -> dict[str, float | None]:
    """Return the shares of true positions in movement held after 0.5 s by the likeliest way's 90 % ellipse, and by all ways.

    doubts (n,): for each recording, so that each can be judged by one that it had no part in. By all ways together: in their
    smallest region of 90 %.
    """
    place, counted = TIMES_S.index(HORIZON_S), []
    for recording, doubt in zip(observations, doubts, strict=True):
        for seen in recording.each:
            if seen.since_s > 0.0 and np.isfinite(seen.truth.positions[place, 0]):
                shares = power_rule(seen, config.likelihood)
                covariance, row = widened(seen, doubt, config), int(shares.argmax())
                likeliest = held(seen.truth.positions - seen.ways.mean[row], covariance[row], LEVEL)
                all_ways = mixture_levels(seen, shares, covariance) < LEVEL
                counted.append((likeliest[place], float(all_ways[place])))
    one, together = np.mean(counted, axis=0).tolist() if counted else (None, None)
    return {'inside_90': one, 'inside_all_90': together}
