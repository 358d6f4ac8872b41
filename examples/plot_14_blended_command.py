# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Rate control with a blended command
===================================

With rate control the operator commands a velocity. `GuidanceOutput.blend_command` replaces a share of it, the authority, by a
velocity of the same size towards the predicted path. The authority is zero without a fresh prediction.
"""

import matplotlib.pyplot as plt
import numpy as np

import foc_ros

RATE_HZ = 100
COMMAND = np.array([0.2, 0.0])

config = foc_ros.Config(budget_s=0.0).with_values({'guidance.rate_hz': float(RATE_HZ), 'guidance.authority': 0.6})


def drive(is_guided: bool) -> tuple[np.ndarray, list[float]]:
    """Return the positions (n, 2) [m] of a tip that is commanded to go straight on, and the authority of guidance."""
    predictor, guidance = foc_ros.Predictor(config), foc_ros.Guidance(config)
    predictor.set_goals([(0.3, 0.0)])
    predictor.set_obstacles([foc_ros.Circle((0.15, -0.01), radius=0.03, radius_stddev=0.002)])
    position, velocity, prediction, positions, authority = np.zeros(2), COMMAND, None, [], []
    for tick in range(150):
        if tick % 4 == 0:
            prediction = predictor.update(tick / RATE_HZ, position)
        output = guidance.update(tick / RATE_HZ, position, velocity, prediction if is_guided else None)
        velocity = output.blend_command(COMMAND)
        position = position + velocity / RATE_HZ
        positions.append(position)
        authority.append(output.authority)
    return np.array(positions), authority


# %%
# The command alone leads through the obstacle.

figure, (scene, graph) = plt.subplots(1, 2, figsize=(11, 4), width_ratios=(1.5, 1), layout='constrained')
for is_guided, label in ((False, 'command'), (True, 'blended')):
    positions, authority = drive(is_guided)
    scene.plot(*positions.T, label=label)
    graph.plot(np.arange(len(authority)) / RATE_HZ, authority, label=label)
scene.add_patch(plt.Circle((0.15, -0.01), 0.03, color='0.7'))
scene.set(xlabel='x [m]', ylabel='y [m]', aspect='equal')
scene.legend()
graph.set(xlabel='time [s]', ylabel='authority')
plt.show()
