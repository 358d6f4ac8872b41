"""Process noise widens the predicted covariance and changes nothing else."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from foc_ros.core.config import Config, replace_values
from foc_ros.core.hand.kalman import compute_gramian
from foc_ros.core.plant.plants import condense, discretise_triple_integrator
from foc_ros.core.plant.replanning import compute_error_map, triple_integrator_process_covariance
from foc_ros.core.predict import predict
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import HandState, make_obstacles


def test_the_covariance_grows_as_in_the_filter_and_is_small_at_the_goal() -> None:
    dt, steps = 0.08, 50
    covariance = triple_integrator_process_covariance(dt, steps)
    assert_array_equal(covariance[0], 0.0)
    assert_allclose(covariance[1], np.kron(compute_gramian(dt), np.eye(2)))
    assert_allclose(covariance[3, 0, 0], (3 * dt) ** 5 / 20, rtol=0.15)
    assert np.sqrt(covariance[-1, 0, 0]) < 0.01 * np.sqrt(covariance[:, 0, 0].max())
    assert_allclose(covariance[:, 0, 1], 0.0, atol=1e-15)
    assert_allclose(covariance[:, 0, 0], covariance[:, 1, 1])


def test_the_covariance_agrees_with_a_hand_that_replans_at_each_step() -> None:
    steps, dt, draws = 12, 0.1, 20_000
    plant, noise = discretise_triple_integrator(dt), np.random.default_rng(3)
    root = np.linalg.cholesky(np.kron(compute_gramian(dt), np.eye(2)))
    error = np.zeros((draws, 6))
    expected = triple_integrator_process_covariance(dt, steps)
    for step in range(steps):
        if steps - step < 3:  # too few steps to bring every state to the goal
            break
        error = error @ compute_error_map(condense(plant, steps - step))[1].T
        error = error + noise.standard_normal((draws, 6)) @ root.T
        assert_allclose(error.var(axis=0), np.diag(expected[step + 1]), rtol=0.05)


def test_predictions_widen_and_keep_means_and_likelihoods() -> None:
    hand = HandState(0, np.array([0.0, 0.0, 0.1, 0.0, 0.0, 0.0]), 1e-6 * np.eye(6), onset_ns=0, onset_position=np.zeros(2))
    scene = make_obstacles([[0.15, 0.01]], 0.03), np.array([[0.3, 0.0]])
    narrow = predict(Config(), hand, *scene, NO_TRACKS)[0]
    wide = predict(replace_values(Config(), {'foc.process_noise': 2.0}), hand, *scene, NO_TRACKS)[0]
    assert len(narrow.solved_candidates) == len(wide.solved_candidates) == 2
    for before, after in zip(narrow.candidates, wide.candidates, strict=True):
        assert_array_equal(before.solution.mean, after.solution.mean)
        assert before.likelihood == after.likelihood
        added = after.solution.covariance - before.solution.covariance
        assert_allclose(added, 4.0 * triple_integrator_process_covariance(before.solution.dt, 50), atol=1e-15)
