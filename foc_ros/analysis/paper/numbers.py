"""Every number of the studies, for JSON, with the paper's beside ours."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from foc_ros.core.types import Solution

from .reaching import PaperScene, measure_solution
from .studies import COUNT, PAPER_ETA, PAPER_RATIOS, EffortCurve, Studies, Study, solve_reported
from .trends import check_trends


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


def _list_scene(scene: PaperScene, noise: float) -> dict[str, Any]:
    names = ('x', 'y', 'radius', 'radius_stddev')
    return {
        'start': [0.0, 0.0],
        'goal': [scene.goal_x, 0.0],
        'noise': [noise, noise],
        'obstacles': [dict(zip(names, circle, strict=True)) for circle in scene.circles],
        'guesses': {each.name: {'amplitude': each.amplitude} for each in scene.path_classes},
    }


def _list_solution(scene: PaperScene, solution: Solution) -> dict[str, Any]:
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
