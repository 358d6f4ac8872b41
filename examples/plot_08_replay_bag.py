# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Replay of a bag
===============

`foc_ros.replay` reads a ROS 2 bag and yields the predictions that the node would have made, without ROS. This example replays the
packaged recording of a simulated operator at 10 predictions a second.
"""

from importlib.resources import files

import matplotlib.pyplot as plt
import numpy as np

import foc_ros

recording = files('foc_ros') / 'recordings' / 'reaching.mcap'
predictions = list(foc_ros.replay(str(recording), foc_ros.Config().with_values({'rate_hz': 10.0})))
print(f'{len(predictions)} predictions in {predictions[-1].t - predictions[0].t:.1f} s of the recording')

# %%
# The left plot shows the positions of the hand, coloured by the likelihood of the most likely candidate. The right plot shows the
# likelihoods of the candidates during the first eight seconds. A candidate ends when its label changes because an obstacle was
# passed.

solved = [prediction for prediction in predictions if prediction.solved_candidates]
figure, (scene, likelihoods) = plt.subplots(1, 2, figsize=(11, 4), width_ratios=(1, 1.2), layout='constrained')
hand = np.array([prediction.candidates[0].mean[0, :2] for prediction in solved])
largest = [prediction.candidates[0].likelihood for prediction in solved]
points = scene.scatter(*hand.T, c=largest, s=12, vmin=0.0, vmax=1.0)
for centre, radius in zip(solved[0].obstacles.centre, solved[0].obstacles.radius, strict=True):
    scene.add_patch(plt.Circle(centre, radius, color='0.7'))
scene.plot(*solved[0].goal_positions.T, 'k*', markersize=10)
scene.set(xlabel='x [m]', ylabel='y [m]', aspect='equal')
figure.colorbar(points, ax=scene, label='likelihood of the most likely candidate')

shown = [prediction for prediction in solved if prediction.t < solved[0].t + 8.0]
times = [prediction.t - solved[0].t for prediction in shown]
for label in sorted({candidate.label for prediction in shown for candidate in prediction.solved_candidates}):
    values = [{each.label: each.likelihood for each in prediction.candidates}.get(label, np.nan) for prediction in shown]
    likelihoods.plot(times, values, marker='.')
likelihoods.set(xlabel='time [s]', ylabel='likelihood', ylim=(0.0, 1.05))
plt.show()
