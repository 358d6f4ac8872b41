# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A guiding force
===============

`foc_ros.Guidance` turns predictions into a bounded force. A hand goes straight towards the edge of an obstacle. The force pushes
it aside, and is zero where no help is needed.
"""

import matplotlib.pyplot as plt
import numpy as np

import foc_ros

RATE_HZ, SPEED = 200, 0.25

# without a time limit the answers do not depend on the machine
config = foc_ros.Config(budget_s=0.0)
predictor, guidance = foc_ros.Predictor(config), foc_ros.Guidance(config)
predictor.set_goals([(0.3, 0.05)])
predictor.set_obstacles([foc_ros.Circle((0.15, 0.0), radius=0.03, name='cup')])

# %%
# Guidance runs at 200 Hz; every eighth update has a new prediction. The hand moves as if the force did not move it.

times = np.arange(0.0, 1.2, 1 / RATE_HZ)
positions = np.column_stack([SPEED * times, np.full(len(times), 0.035)])
outputs, predictions = [], []
for tick, (t, position) in enumerate(zip(times, positions, strict=True)):
    if tick % 8 == 0:
        predictions.append(predictor.update(t, position))
    outputs.append(guidance.update(t, position, (SPEED, 0.0), predictions[-1]))
forces = np.array([output.force for output in outputs])

# %%
# The left plot shows the prediction after a quarter of a second, and the force along the whole path; the right one the size of
# the force and the agreement of the candidates.

figure, (scene, graph) = plt.subplots(1, 2, figsize=(11, 4), width_ratios=(1.5, 1), layout='constrained')
predictions[6].plot(scene)
(line,) = scene.plot(*positions.T, color='black', linewidth=1, label='path of the hand')
look = {'angles': 'xy', 'scale_units': 'xy', 'scale': 60.0, 'width': 0.004, 'color': 'tab:green', 'zorder': 6}
arrows = scene.quiver(*positions[::6].T, *forces[::6].T, label='force', **look)
scene.legend(handles=[line, arrows], loc='lower right')
graph.plot(times, np.hypot(*forces.T), label='force [N]')
graph.plot(times, [output.agreement for output in outputs], label='agreement')
graph.set(xlabel='time [s]')
graph.legend()
plt.show()
