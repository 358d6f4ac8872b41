# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Prediction while a hand moves
=============================

A `foc_ros.Predictor` follows one hand. Each call of `update` takes a measured position and returns a prediction. This example
simulates a hand that passes an obstacle on the left and reaches the second of three goals.
"""

import matplotlib.pyplot as plt
import numpy as np

import foc_ros

GOALS = [(0.24, 0.13), (0.30, 0.0), (0.24, -0.13)]
RATE_HZ, DURATION_S = 50, 1.0

values = {'homotopy.max_candidates': 6, 'duration.model': 'fixed', 'likelihood.beta': 1.0}
# without a time limit the answers do not depend on the machine
predictor = foc_ros.Predictor(foc_ros.Config(budget_s=0.0).with_values(values))
predictor.set_goals(GOALS)
predictor.set_obstacles([foc_ros.Circle((0.14, 0.0), radius=0.03, radius_stddev=0.003, name='cup')])


def measure_hand(t: float, noise: np.random.Generator) -> np.ndarray:
    """Return the measured position (2,) [m] of a hand on a curved minimum-jerk movement."""
    s = np.clip(t / DURATION_S, 0.0, 1.0)
    share = 10 * s**3 - 15 * s**4 + 6 * s**5
    return np.array([0.30 * share, 0.055 * np.sin(np.pi * share)]) + noise.normal(0.0, 0.0005, 2)


generator = np.random.default_rng(1)
times = np.arange(0.0, DURATION_S, 1 / RATE_HZ)
positions = [measure_hand(t, generator) for t in times]
predictions = [predictor.update(t, position) for t, position in zip(times, positions, strict=True)]

# %%
# The left plot shows the prediction after 0.3 s with the path of the hand until then. The right plot shows the likelihood of
# every goal: the sum over the candidates that lead to it.

figure, (scene, shares) = plt.subplots(1, 2, figsize=(11, 5.5), layout='constrained')
shown = predictions[round(0.3 * RATE_HZ)]
shown.plot(scene)
(line,) = scene.plot(*np.array(positions[: round(0.3 * RATE_HZ) + 1]).T, color='black', linewidth=2, label='path of the hand')
scene.set_xlim(left=-0.01)
scene.legend(handles=[line])
for row, goal in enumerate(shown.goals):
    shares.plot(times, [prediction.goals[row].likelihood for prediction in predictions], label=goal.name)
shares.set(xlabel='time [s]', ylabel='likelihood', ylim=(0.0, 1.0))
shares.legend()
plt.show()
