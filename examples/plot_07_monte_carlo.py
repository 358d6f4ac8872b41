# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Monte Carlo
===========

The chance constraint holds for each obstacle and each step. It uses a bound on the probability that holds for every distribution,
and is therefore conservative. `foc_ros.monte_carlo` executes a solution many times with random motor noise and random radii, and
counts how often the movement keeps clear of the true circles.
"""

import matplotlib.pyplot as plt
import numpy as np

import foc_ros

obstacles = [foc_ros.Circle((0.10, -0.01), 0.03, 0.003), foc_ros.Circle((0.20, -0.02), 0.02, 0.002)]
config = foc_ros.Config().with_values({'foc.noise_x': 0.1, 'foc.noise_y': 0.1})
etas = np.array([0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.95])
solutions = [foc_ros.solve((0.0, 0.0), (0.3, 0.0), obstacles, eta=eta, strategy='optimal', config=config) for eta in etas]
results = [foc_ros.monte_carlo(solution, samples=5000, seed=0) for solution in solutions]

# %%
# A larger eta gives a wider arc. `step` is the fraction that keeps clear at the worst step, `path` is the fraction that keeps
# clear at all steps. Both come with an interval of 95 %.

figure, (scene, axes) = plt.subplots(1, 2, figsize=(11, 4), width_ratios=(1.5, 1), layout='constrained')
for obstacle in obstacles:
    scene.add_patch(plt.Circle(obstacle.centre, obstacle.radius, color='0.7'))
for eta, solution in zip(etas[::3], solutions[::3], strict=True):
    scene.plot(*solution.path.T, label=f'eta {eta:g}')
scene.set(xlabel='x [m]', ylabel='y [m]', ylim=(-0.05, 0.09), aspect='equal')
scene.legend()
for name, measured in (('worst step', [each.step for each in results]), ('whole path', [each.path for each in results])):
    fraction, low, high = np.array(measured).T
    axes.errorbar(etas, fraction, (fraction - low, high - fraction), marker='o', capsize=3, label=name)
axes.plot(etas, etas, color='0.5', linestyle='--', label='guaranteed for each step')
axes.set(xlabel='eta', ylabel='fraction that keeps clear')
axes.legend()
plt.show()
