"""The smallest region of all candidates together has the probability that it states, however the candidates overlap."""

from dataclasses import replace

import numpy as np
import pytest
from evaluation_samples import H, make_candidates, observation, recorded

from foc_ros.analysis.evaluation.scores import compute_position_scores, find_denser_share
from foc_ros.core.types import LEFT, RIGHT


def test_the_region_of_one_gaussian_is_its_ellipse() -> None:
    covariance = np.array([[4.0, 1.0], [1.0, 2.0]])
    root = np.linalg.cholesky(covariance)
    for level in (0.5, 0.9):
        border = root @ np.array([0.6, 0.8]) * np.sqrt(-2.0 * np.log(1.0 - level))
        positions = np.array([3.0, -1.0]) + np.array([0.99, 1.01])[:, None] * border
        found = find_denser_share(np.ones(1), np.full((1, 2, 2), [3.0, -1.0]), np.tile(covariance, (1, 2, 1, 1)), positions)
        assert found[0] < level < found[1]


@pytest.mark.parametrize('apart', [0.0, 1.5, 10.0])
def test_the_region_holds_its_share_of_samples(apart: float) -> None:
    draws, count = np.random.default_rng(5), 4000
    likelihood = np.array([0.6, 0.3, 0.1])
    mean = apart * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    covariance = np.array([np.diag([1.0, 1.0]), [[2.0, 0.9], [0.9, 0.5]], np.diag([0.1, 0.1])])
    component = draws.choice(3, count, p=likelihood)
    positions = mean[component] + np.einsum(
        'nij,nj->ni', np.linalg.cholesky(covariance)[component], draws.standard_normal((count, 2))
    )
    many = count, 1, 1
    found = find_denser_share(
        likelihood, np.tile(mean[:, None], (1, count, 1)), np.tile(covariance[:, None], (1, *many)), positions
    )
    for level in (0.5, 0.9):
        assert np.mean(found < level) == pytest.approx(level, abs=0.03)


def test_a_position_in_a_less_likely_class_is_in_the_region_and_not_in_the_ellipse_of_the_likeliest() -> None:
    two = make_candidates([[LEFT], [RIGHT]], likelihood=[0.6, 0.4])
    two = replace(two, mean=np.stack([np.zeros((H, 2)), np.full((H, 2), [10.0, 0.0])]))
    true = np.full((H, 2), [11.6, 0.0])
    true[-1] = np.nan
    scores = compute_position_scores([recorded(observation(two, positions=true, true_sides=(RIGHT,)))])
    assert scores['inside']['0.9'] == {'0.25': 0.0, '0.5': 0.0, '1': None}
    assert scores['inside_taken']['0.9'] == {'0.25': 1.0, '0.5': 1.0, '1': None}
    assert scores['inside_all']['0.9'] == {'0.25': 1.0, '0.5': 1.0, '1': None}
    assert scores['inside_all']['0.5'] == {'0.25': 0.0, '0.5': 0.0, '1': None}


def test_positions_are_scored_given_what_is_known() -> None:
    """The unknown share has no path, and so no part in the density of positions."""
    scores = []
    for known in (1.0, 0.5):
        two = make_candidates([[LEFT], [RIGHT]], likelihood=[0.6 * known, 0.4 * known])
        two = replace(two, mean=np.stack([np.zeros((H, 2)), np.full((H, 2), [1.0, 0.0])]))
        scores.append(compute_position_scores([recorded(observation(two, positions=np.full((H, 2), [0.5, 0.2])))]))
    for name in ('nlpd', 'inside_all', 'displacement_m'):
        assert str(scores[0][name]) == str(scores[1][name])
