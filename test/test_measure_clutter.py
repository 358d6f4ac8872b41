"""The study of clutter on small input: scenes keep their gaps, and safety factors between the steps agree with the solver."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest
from reach_helpers import bowed, one_obstacle, solved

from foc_ros.core.config import Config

sys.path.append(str(Path(__file__).resolve().parents[1] / 'scripts'))

measure_clutter = importlib.import_module('measure_clutter')


def test_circles_of_clutter_do_not_touch_each_other_nor_the_ends() -> None:
    circles = measure_clutter.draw_circles(16, 1)
    gaps = np.hypot(*(circles.centre[:, None] - circles.centre).transpose(2, 0, 1)) - circles.radius - circles.radius[:, None]
    assert len(circles) == 16
    assert gaps[~np.eye(16, dtype=bool)].min() > 0.002
    for end in (np.zeros(2), measure_clutter.GOAL):
        assert (np.hypot(*(circles.centre - end).T) - circles.radius).min() > 0.02
    assert np.array_equal(circles.centre, measure_clutter.draw_circles(16, 1).centre)


def test_the_least_safety_factor_agrees_with_the_solver() -> None:
    problem, guess = one_obstacle(0.9, (0.1, 0.1)), bowed((0, 0), (0.3, 0), 50, 0.05)
    assert measure_clutter.find_least_share(problem, solved(problem, guess, 'lv')) == pytest.approx(1.0, abs=2e-4)
    fixed = solved(problem, guess, 'fixed', tau=1e-3, lam=1e4)
    wanted = np.sqrt(problem.eta / (1.0 - problem.eta))
    assert measure_clutter.find_least_share(problem, fixed) == pytest.approx(
        np.sqrt(fixed.eta / (1.0 - fixed.eta)) / wanted, rel=1e-4
    )


def test_ticks_and_classes_in_clutter_are_counted() -> None:
    config = Config().with_values({'foc.steps': 10, 'homotopy.max_candidates': 2})
    seconds, found, takes_part = measure_clutter.time_ticks(measure_clutter.draw_circles(4, 1), config)
    assert (seconds > 0.0).all()
    assert 0 < takes_part <= found <= 2
