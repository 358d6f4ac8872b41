"""Every number of the studies, for JSON, with the paper's beside ours."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from foc_ros.core.types import Solution

from .reaching import PaperScene, clearance, largest_stddev, path_length, speed, speed_to_obstacles
from .studies import PAPER_ETA, PAPER_RATIOS, EffortCurve, Studies, Study
from .trends import trends


def as_json(studies: Studies) -> dict[str, Any]:
    """Return every number of the studies, to six significant digits; null where nothing was solved."""
    last = studies.optimal
    return {
        'trends': [
            {'study': each.study, 'statement': each.statement, 'paper': each.paper, 'ours': each.ours, 'holds': each.holds}
            for each in trends(studies)
        ],
        f'ratio_at_eta_{PAPER_ETA:g}': {
            name: {'paper': PAPER_RATIOS[number], 'ours': _rounded(studies[number].ratios[0].at(PAPER_ETA))}
            for name, number in (('LV', 5), ('HC', 6))
        },
        'studies': [_study(each) for each in studies.paper],
        'study_7': {
            'scene': _scene(last.scene, last.noise),
            'efforts': [_curve(each) for each in last.efforts],
            'rolled_out': {
                name: [
                    {'eta': eta, 'samples': each.samples, 'clear_at_worst_step': each.step[0], 'clear_on_path': each.path[0]}
                    for eta, each in rolled.items()
                ]
                for name, rolled in last.rolled.items()
            },
        },
        'reported_tau_and_lambda': {name: _solution(studies[1].scene, each) for name, each in studies.reported.items()},
    }


def _study(study: Study) -> dict[str, Any]:
    return {
        'study': study.number,
        'title': study.title,
        'scene': _scene(study.scene, study.noise),
        'shown': {
            f'{eta:g}': {name: _solution(study.scene, each) for name, each in shown.items()} for eta, shown in study.shown.items()
        },
        'ratios': [
            {
                'name': each.name,
                'eta': list(each.over.etas),
                'ratio': [_rounded(value) for value in each.values],
                'efforts': [_curve(each.over), _curve(each.under)],
            }
            for each in study.ratios
        ],
    }


def _scene(scene: PaperScene, noise: float) -> dict[str, Any]:
    names = ('x', 'y', 'radius', 'radius_stddev')
    return {
        'start': [0.0, 0.0],
        'goal': [scene.goal_x, 0.0],
        'noise': [noise, noise],
        'obstacles': [dict(zip(names, circle, strict=True)) for circle in scene.circles],
        'guesses': {way.name: {'amplitude': way.amplitude} for way in scene.ways},
    }


def _solution(scene: PaperScene, solution: Solution) -> dict[str, Any]:
    values: Mapping[str, float] = {
        'effort': solution.effort,
        'eta': solution.eta,
        'tau': solution.tau,
        'lambda': solution.lam,
        'clearance': clearance(scene, solution),
        'path_length': path_length(solution),
        'largest_stddev': largest_stddev(solution),
        'peak_speed': float(speed(solution).max()),
        'speed_to_obstacles': speed_to_obstacles(scene, solution),
    }
    return {'status': solution.status.value, **{name: _rounded(value) for name, value in values.items()}}


def _curve(curve: EffortCurve) -> dict[str, Any]:
    return {
        'name': curve.name,
        'eta': list(curve.etas),
        'effort': [_rounded(value) for value in curve.efforts],
        'eta_achieved': [_rounded(each.eta) for each in curve.solutions],
        'tau': [_rounded(each.tau) for each in curve.solutions],
        'lambda': [_rounded(each.lam) for each in curve.solutions],
        'status': [each.status.value for each in curve.solutions],
    }


def _rounded(value: float) -> float | None:
    return float(f'{value:.6g}') if np.isfinite(value) else None
