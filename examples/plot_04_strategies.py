# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Three strategies
================

A strategy trades clearance against precision. `lv` slows down near obstacles, `hc` keeps a larger distance, and `optimal` takes
the least effort. All three meet the same eta in the same time.
"""

import matplotlib.pyplot as plt
import numpy as np

import foc_ros

obstacle = foc_ros.Circle((0.12, -0.005), radius=0.03, radius_stddev=0.003)
config = foc_ros.Config().with_values({'foc.noise_x': 0.15, 'foc.noise_y': 0.15})

figure, (paths, speeds) = plt.subplots(1, 2, figsize=(11, 3.6), width_ratios=(1.5, 1), layout='constrained')
paths.add_patch(plt.Circle(obstacle.centre, obstacle.radius, color='0.7'))
for strategy in ('lv', 'hc', 'optimal'):
    solution = foc_ros.solve((0.0, 0.0), (0.3, 0.0), [obstacle], eta=0.94, strategy=strategy, config=config)
    paths.plot(*solution.path.T, marker='.', label=strategy)
    speed = np.hypot(*solution.mean[:, 2:4].T)
    speeds.plot(solution.times, speed, label=f'{strategy}: effort {solution.effort:,.0f} m²/s⁶')

paths.set(xlabel='x [m]', ylabel='y [m]', ylim=(-0.07, 0.07), aspect='equal')
paths.legend(loc='lower right')
speeds.set(xlabel='time [s]', ylabel='speed [m/s]', ylim=(0.0, 1.4 * speeds.get_ylim()[1]))
speeds.legend(loc='upper left')
plt.show()
