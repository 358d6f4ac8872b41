# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Uncertain radii
===============

Perception rarely knows the size of an obstacle exactly. `radius_stddev` is the standard deviation of the radius. The movement
keeps a larger distance from an obstacle whose radius is uncertain, and needs more effort.
"""

import matplotlib.pyplot as plt
import numpy as np

import foc_ros

RADIUS = 0.03
deviations = np.linspace(0.0, 0.008, 9)
solutions = [
    foc_ros.solve((0.0, 0.0), (0.3, 0.0), [foc_ros.Circle((0.15, -0.005), RADIUS, deviation)], strategy='optimal', eta=0.9)
    for deviation in deviations
]

figure, (paths, efforts) = plt.subplots(1, 2, figsize=(11, 3.6), width_ratios=(1.5, 1), layout='constrained')
paths.add_patch(plt.Circle((0.15, -0.005), RADIUS, color='0.7'))
for deviation, solution in zip(deviations[::4], solutions[::4], strict=True):
    paths.plot(*solution.path.T, label=f'{1000 * deviation:.0f} mm')
paths.set(xlabel='x [m]', ylabel='y [m]', ylim=(-0.06, 0.06), aspect='equal')
paths.legend(title='standard deviation', loc='lower right')
efforts.plot(1000 * deviations, [solution.effort for solution in solutions], marker='o')
efforts.set(xlabel='standard deviation of the radius [mm]', ylabel='effort [m²/s⁶]', ylim=(0.0, None))
plt.show()
