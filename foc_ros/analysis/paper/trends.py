"""The trends of the paper's studies, and whether they appear here."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from foc_ros.core.types import Array

from .reaching import measure_solution
from .studies import PAPER_ETA, PAPER_RATIOS, REPORTED, RatioCurve, Studies, Study

SIMILAR = 4 / 3
"""Factor within which two efforts count as similar."""
ROUNDING = 1e-3
"""Relative difference of two efforts that may come from rounding."""
KNEE = 0.9
"""Up to this eta the two classes cost the same in the paper."""


@dataclass(frozen=True)
class Trend:
    """What a study of the paper shows, the numbers of the paper and ours, and whether it holds here."""

    study: int
    statement: str
    paper: str
    ours: str
    holds: bool


def check_trends(studies: Studies) -> tuple[Trend, ...]:
    """Check the trend of every study."""
    return (
        _check_clearance_and_speed(studies[1]),
        _check_precision_and_length(studies[2]),
        _check_rise(studies[3]),
        _check_stays_below(studies[4]),
        _check_fall(studies[5], 'falls', _is_below(studies[5].ratios[0].at(PAPER_ETA), 0.6)),
        _check_fall(
            studies[6], 'falls less', _is_below(studies[5].ratios[0].at(PAPER_ETA), studies[6].ratios[0].at(PAPER_ETA), 1.0)
        ),
        _check_optimal(studies[7]),
    )


def _check_clearance_and_speed(study: Study) -> Trend:
    lv, hc = (measure_solution(study.scene, study.solutions[0.94][name]) for name in ('LV', 'HC'))
    ours = (
        f'clearance {1e3 * lv["clearance"]:.1f} and {1e3 * hc["clearance"]:.1f} mm, '
        f'mean speed up to there {lv["speed_to_obstacles"]:.2f} and {hc["speed_to_obstacles"]:.2f} m/s; '
        f'τ {lv["tau"]:.2g} and {hc["tau"]:.2g} m², λ {lv["lambda"]:.2g} and {hc["lambda"]:.2g}'
    )
    (lv_tau, lv_lambda), (hc_tau, hc_lambda) = REPORTED['LV'], REPORTED['HC']
    paper = f'τ {lv_tau:g} and {hc_tau:g} m², λ {lv_lambda:.3g} and {hc_lambda:.2g}'
    statement = 'at η = 0.94, LV passes nearer to the obstacles than HC, and goes slower up to there'
    is_nearer, is_slower = lv['clearance'] < hc['clearance'], lv['speed_to_obstacles'] < hc['speed_to_obstacles']
    return Trend(1, statement, paper, ours, is_nearer and is_slower and lv['lambda'] > hc['lambda'])


def _check_precision_and_length(study: Study) -> Trend:
    low, high = (
        {name: measure_solution(study.scene, each) for name, each in study.solutions[eta].items()} for eta in (0.86, 0.95)
    )
    ours = '; '.join(
        f'{name}: {1e3 * low[name]["largest_stddev"]:.1f} to {1e3 * high[name]["largest_stddev"]:.1f} mm, '
        f'path {1e3 * high[name]["path_length"]:.0f} mm'
        for name in ('LV', 'HC')
    )
    shrinking = {name: high[name]['largest_stddev'] / low[name]['largest_stddev'] for name in ('LV', 'HC')}
    holds = shrinking['LV'] < shrinking['HC'] and high['LV']['path_length'] < high['HC']['path_length']
    statement = 'from η = 0.86 to 0.95, the spread under LV shrinks more than under HC, whose path is the longer'
    return Trend(2, statement, 'figures only', ours, holds)


def _check_rise(study: Study) -> Trend:
    ratio = study.ratios[0]
    values, crossings = ratio.values, find_crossings(ratio)
    listed = ' and '.join(f'{eta:.3f}' for eta in crossings) or 'no eta'
    ours = f'{values[0]:.2f} at η = {ratio.etas[0]:g}, through 1 at {listed}, {ratio.at(0.95):.2f} at 0.95'
    holds = bool(np.isfinite(values).all()) and _is_below(values[0], 1.0, ratio.at(0.95)) and len(crossings) == 1
    return Trend(3, f'c = {study.noise:g}: J_LV / J_HC rises through 1', 'rises through 1', ours, holds)


def _check_stays_below(study: Study) -> Trend:
    values = study.ratios[0].values
    ours = f'from {values[0]:.2f} to {values[-1]:.2f}, at most {np.nanmax(values):.3f}, at least {np.nanmin(values):.2f}'
    holds = bool(np.isfinite(values).all() and values.max() < 1 + ROUNDING and values[-1] < 0.99)
    return Trend(4, f'c = {study.noise:g}: J_LV / J_HC stays below 1', 'stays below 1', ours, holds)


def _check_fall(study: Study, verb: str, has_fallen: bool) -> Trend:
    ratio, strategy = study.ratios[0], {5: 'LV', 6: 'HC'}[study.number]
    early = ratio.values[ratio.etas <= KNEE]
    ours = f'{early.min():.2f} to {early.max():.2f} up to η = {KNEE:g}, {ratio.at(PAPER_ETA):.2f} at {PAPER_ETA:g}'
    statement = f'J_H1 / J_H2 under {strategy} is near 1 up to η = {KNEE:g} and {verb}'
    paper = f'{PAPER_RATIOS[study.number]:g} at {PAPER_ETA:g}'
    return Trend(study.number, statement, paper, ours, _is_near_one(early) and has_fallen)


def _check_optimal(study: Study) -> Trend:
    efforts = {curve.name: curve.efforts for curve in study.efforts}
    share = efforts['optimal'] / np.fmin(efforts['LV'], efforts['HC'])
    excess = min(each.step[0] - eta for rolled in study.rolled_out.values() for eta, each in rolled.items())
    ours = (
        f'effort {share.min():.2f} to {share.max():.2f} of the cheaper of the two; roll-outs stay clear at least '
        f'{excess:.3f} more often than η at the worst step'
    )
    statement = 'optimal costs less than LV and HC at every η, and all three keep η'
    return Trend(7, statement, 'not in the paper', ours, bool((share < 1 + ROUNDING).all() and excess >= 0))


def find_crossings(ratio: RatioCurve) -> list[float]:
    """Return the etas, interpolated between those of the grid, at which a ratio rises or falls through 1."""
    height, etas = np.log(ratio.values), ratio.etas
    rows = np.flatnonzero(np.sign(height[1:]) * np.sign(height[:-1]) < 0)
    return [float(etas[row] - height[row] * (etas[row + 1] - etas[row]) / (height[row + 1] - height[row])) for row in rows]


def _is_near_one(values: Array) -> bool:
    return bool(np.isfinite(values).all() and (np.abs(np.log(values)) < np.log(SIMILAR)).all())


def _is_below(*values: float) -> bool:
    """Tell whether each value is below the next one."""
    return bool((np.diff(values) > 0.0).all())
