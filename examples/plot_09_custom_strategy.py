# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A custom strategy
=================

A strategy is a function that is registered under a name. This one keeps the precision weight lambda constant, and finds the
smallest clearance term tau that meets eta by bisection. It uses the built-in strategy `fixed`, which solves the problem for one
pair of tau and lambda.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import foc_ros

LARGEST_TAU, BISECTIONS = 0.01, 14


def solve_constant_precision(problems, starts, settings, deadline) -> list[foc_ros.StrategyResult]:
    """Return the solutions with the smallest tau that meets eta at lambda = foc.lam."""
    return [find_least_tau(problem, start, settings, deadline) for problem, start in zip(problems, starts, strict=True)]


def find_least_tau(problem, start, settings, deadline) -> foc_ros.StrategyResult:
    """Return the solution of one problem."""

    def solve(tau: float) -> tuple[foc_ros.StrategyResult, bool]:
        (result,) = foc_ros.get_strategy('fixed')([problem], [start], replace(settings, tau=tau), deadline)
        is_enough = foc_ros.compute_eta(problem, result.control) >= problem.eta
        return replace(result, aims_at_eta=True), is_enough and result.status is foc_ros.Status.SOLVED

    low, high = 0.0, LARGEST_TAU
    best, is_enough = solve(high)
    if not is_enough:
        return replace(best, status=foc_ros.Status.ETA_UNREACHABLE, message=f'eta is out of reach at tau = {high:g} m^2')
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        result, is_enough = solve(middle)
        if is_enough:
            high, best = middle, result
        else:
            low = middle
    return best


foc_ros.register_strategy('constant_precision', solve_constant_precision)

# %%
# The name can now be used like those of the built-in strategies, here and in a parameter file.

obstacles = [foc_ros.Circle((0.12, -0.005), radius=0.03, radius_stddev=0.003)]
config = foc_ros.Config().with_values({'foc.noise_x': 0.1, 'foc.noise_y': 0.1, 'foc.lam': 1e5})
figure, (paths, efforts) = plt.subplots(1, 2, figsize=(11, 3.6), width_ratios=(1.5, 1), layout='constrained')
paths.add_patch(plt.Circle(obstacles[0].centre, obstacles[0].radius, color='0.7'))
etas = np.linspace(0.6, 0.92, 9)
for strategy in ('constant_precision', 'optimal'):
    solutions = [foc_ros.solve((0.0, 0.0), (0.3, 0.0), obstacles, eta=eta, strategy=strategy, config=config) for eta in etas]
    paths.plot(*solutions[-1].path.T, marker='.', label=strategy)
    efforts.plot(etas, [each.effort for each in solutions], marker='o', label=strategy)
paths.set(xlabel='x [m]', ylabel='y [m]', ylim=(-0.07, 0.07), aspect='equal')
paths.legend(loc='lower right')
efforts.set(xlabel='eta', ylabel='effort [m²/s⁶]')
plt.show()
