# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The seven checks: the trend of each study of the paper, and whether it appears here; and all numbers as plain values."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from studies import (
    COUNT,
    PAPER_ETA,
    PAPER_RATIOS,
    REPORTED,
    Array,
    EffortCurve,
    RatioCurve,
    Scene,
    Studies,
    Study,
    measure_solution,
    solve_reported,
)

import foc_ros

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


def as_json(studies: Studies) -> dict[str, Any]:
    """Return every number of the studies, to six significant digits; null where nothing was solved."""
    last = studies[COUNT]
    return {
        'trends': [asdict(each) for each in check_trends(studies)],
        f'ratio_at_eta_{PAPER_ETA:g}': {
            name: {'paper': PAPER_RATIOS[number], 'ours': _round(studies[number].ratios[0].at(PAPER_ETA))}
            for name, number in (('LV', 5), ('HC', 6))
        },
        'studies': [_list_study(each) for each in studies.values() if each is not last],
        'study_7': {
            'scene': _list_scene(last.scene, last.noise),
            'efforts': [_list_curve(each) for each in last.efforts],
            'rolled_out': {
                name: [
                    {'eta': eta, 'samples': each.samples, 'clear_at_worst_step': each.step[0], 'clear_on_path': each.path[0]}
                    for eta, each in rolled.items()
                ]
                for name, rolled in last.rolled_out.items()
            },
        },
        'reported_tau_and_lambda': {name: _list_solution(studies[1].scene, each) for name, each in solve_reported().items()},
    }


def _list_study(study: Study) -> dict[str, Any]:
    return {
        'study': study.number,
        'title': study.title,
        'scene': _list_scene(study.scene, study.noise),
        'shown': {
            f'{eta:g}': {name: _list_solution(study.scene, each) for name, each in solutions.items()}
            for eta, solutions in study.solutions.items()
        },
        'ratios': [
            {
                'name': each.name,
                'eta': list(each.numerator.etas),
                'ratio': [_round(value) for value in each.values],
                'efforts': [_list_curve(each.numerator), _list_curve(each.denominator)],
            }
            for each in study.ratios
        ],
    }


def _list_scene(scene: Scene, noise: float) -> dict[str, Any]:
    names = ('x', 'y', 'radius', 'radius_stddev')
    return {
        'start': [0.0, 0.0],
        'goal': [scene.goal_x, 0.0],
        'noise': [noise, noise],
        'obstacles': [dict(zip(names, circle, strict=True)) for circle in scene.circles],
        'guesses': {each.name: {'amplitude': each.amplitude} for each in scene.path_classes},
    }


def _list_solution(scene: Scene, solution: foc_ros.Solution) -> dict[str, Any]:
    return {
        'status': solution.status.value,
        **{name: _round(value) for name, value in measure_solution(scene, solution).items()},
    }


def _list_curve(curve: EffortCurve) -> dict[str, Any]:
    return {
        'name': curve.name,
        'eta': list(curve.etas),
        'effort': [_round(value) for value in curve.efforts],
        'eta_achieved': [_round(each.eta) for each in curve.solutions],
        'tau': [_round(each.tau) for each in curve.solutions],
        'lambda': [_round(each.lam) for each in curve.solutions],
        'status': [each.status.value for each in curve.solutions],
    }


def _round(value: float) -> float | None:
    return float(f'{value:.6g}') if np.isfinite(value) else None
