"""What every study of the paper shows, and whether ours shows it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from foc_ros.core.types import Array

from .reaching import clearance, largest_stddev, path_length, speed_to_obstacles
from .studies import PAPER_ETA, PAPER_RATIOS, REPORTED, RatioCurve, Studies, Study

NEAR_ONE = 4 / 3
"""Factor within which two efforts count as similar."""
ROUNDING = 1e-3
"""Relative difference of two efforts that may be one of rounding."""
KNEE = 0.9
"""Up to this eta the two ways cost the same in the paper."""


@dataclass(frozen=True)
class Trend:
    """What a study of the paper shows, whether ours shows it, and the numbers: the paper's and ours."""

    study: int
    statement: str
    paper: str
    ours: str
    holds: bool


def trends(studies: Studies) -> tuple[Trend, ...]:
    """Judge every study."""
    return (
        _slow_or_wide(studies[1]),
        _precision(studies[2]),
        _rises(studies[3]),
        _stays_below(studies[4]),
        _falls(studies[5]),
        _falls_less(studies[6], studies[5]),
        _cheapest(studies),
    )


def _slow_or_wide(study: Study) -> Trend:
    lv, hc = study.shown[0.94]['LV'], study.shown[0.94]['HC']
    gaps = [1e3 * clearance(study.scene, each) for each in (lv, hc)]
    slow = [speed_to_obstacles(study.scene, each) for each in (lv, hc)]
    ours = (
        f'clearance {gaps[0]:.1f} and {gaps[1]:.1f} mm, mean speed up to there {slow[0]:.2f} and {slow[1]:.2f} m/s; '
        f'τ {lv.tau:.2g} and {hc.tau:.2g} m², λ {lv.lam:.2g} and {hc.lam:.2g}'
    )
    reported = [REPORTED[name] for name in ('LV', 'HC')]
    paper = f'τ {reported[0][0]:g} and {reported[1][0]:g} m², λ {reported[0][1]:.3g} and {reported[1][1]:.2g}'
    statement = 'at η = 0.94, LV passes nearer to the obstacles than HC, and goes slower up to there'
    return Trend(1, statement, paper, ours, gaps[0] < gaps[1] and slow[0] < slow[1] and lv.lam > hc.lam)


def _precision(study: Study) -> Trend:
    low, high = study.shown[0.86], study.shown[0.95]
    spread = {name: (1e3 * largest_stddev(low[name]), 1e3 * largest_stddev(high[name])) for name in ('LV', 'HC')}
    length = {name: 1e3 * path_length(high[name]) for name in ('LV', 'HC')}
    ours = '; '.join(
        f'{name}: {spread[name][0]:.1f} to {spread[name][1]:.1f} mm, path {length[name]:.0f} mm' for name in ('LV', 'HC')
    )
    shrinks = spread['LV'][1] / spread['LV'][0] < spread['HC'][1] / spread['HC'][0]
    statement = 'from η = 0.86 to 0.95, the spread under LV shrinks more than under HC, whose path is the longer'
    return Trend(2, statement, 'figures only', ours, bool(shrinks and length['LV'] < length['HC']))


def _rises(study: Study) -> Trend:
    ratio = study.ratios[0]
    values = ratio.values
    crossing = crossings(ratio)
    ours = f'{values[0]:.2f} at η = {ratio.etas[0]:g}, through 1 at {_listed(crossing)}, {ratio.at(0.95):.2f} at 0.95'
    holds = bool(np.isfinite(values).all() and values[0] < 1 < ratio.at(0.95)) and len(crossing) == 1
    return Trend(3, f'c = {study.noise:g}: J_LV / J_HC rises through 1', 'rises through 1', ours, holds)


def _stays_below(study: Study) -> Trend:
    values = study.ratios[0].values
    ours = f'from {values[0]:.2f} to {values[-1]:.2f}, at most {np.nanmax(values):.3f}, at least {np.nanmin(values):.2f}'
    holds = bool(np.isfinite(values).all() and values.max() < 1 + ROUNDING and values[-1] < 0.99)
    return Trend(4, f'c = {study.noise:g}: J_LV / J_HC stays below 1', 'stays below 1', ours, holds)


def _falls(study: Study) -> Trend:
    ratio = study.ratios[0]
    early = ratio.values[ratio.etas <= KNEE]
    ours = f'{early.min():.2f} to {early.max():.2f} up to η = {KNEE:g}, {ratio.at(PAPER_ETA):.2f} at {PAPER_ETA:g}'
    holds = bool(_near_one(early) and ratio.at(PAPER_ETA) < 0.6)
    statement = f'J_H1 / J_H2 under LV is near 1 up to η = {KNEE:g} and falls'
    return Trend(5, statement, f'{PAPER_RATIOS[5]:g} at {PAPER_ETA:g}', ours, holds)


def _falls_less(study: Study, lv: Study) -> Trend:
    ratio = study.ratios[0]
    early = ratio.values[ratio.etas <= KNEE]
    ours = f'{early.min():.2f} to {early.max():.2f} up to η = {KNEE:g}, {ratio.at(PAPER_ETA):.2f} at {PAPER_ETA:g}'
    holds = bool(_near_one(early) and lv.ratios[0].at(PAPER_ETA) < ratio.at(PAPER_ETA) < 1)
    return Trend(
        6,
        f'J_H1 / J_H2 under HC is near 1 up to η = {KNEE:g} and falls less',
        f'{PAPER_RATIOS[6]:g} at {PAPER_ETA:g}',
        ours,
        holds,
    )


def _cheapest(studies: Studies) -> Trend:
    efforts = {curve.name: curve.efforts for curve in studies.optimal.efforts}
    others = np.fmin(efforts['LV'], efforts['HC'])
    share = efforts['optimal'] / others
    step = {name: {eta: each.step[0] for eta, each in rolled.items()} for name, rolled in studies.optimal.rolled.items()}
    least = min(clear - eta for rolled in step.values() for eta, clear in rolled.items())
    ours = (
        f'effort {share.min():.2f} to {share.max():.2f} of the cheaper of the two; roll-outs stay clear at least '
        f'{least:.3f} more often than η at the worst step'
    )
    statement = 'optimal costs less than LV and HC at every η, and all three keep η'
    return Trend(7, statement, 'not in the paper', ours, bool((share < 1 + ROUNDING).all() and least >= 0))


def _near_one(values: Array) -> bool:
    return bool(np.isfinite(values).all() and (np.abs(np.log(values)) < np.log(NEAR_ONE)).all())


def crossings(ratio: RatioCurve) -> list[float]:
    """Return the etas, read off between the grid's, at which a ratio rises or falls through 1."""
    height, etas = np.log(ratio.values), ratio.etas
    rows = np.flatnonzero(np.sign(height[1:]) * np.sign(height[:-1]) < 0)
    return [float(etas[row] - height[row] * (etas[row + 1] - etas[row]) / (height[row + 1] - height[row])) for row in rows]


def _listed(values: list[float]) -> str:
    return ' and '.join(f'{value:.3f}' for value in values) or 'no eta'
