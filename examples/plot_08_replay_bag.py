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

import foc_ros

recording = files('foc_ros') / 'recordings' / 'reaching.mcap'
predictions = []
for prediction in foc_ros.replay(str(recording), foc_ros.Config().with_values({'rate_hz': 10.0})):
    predictions.append(prediction)
    if prediction.t > predictions[0].t + 8.0:
        break
print(f'{len(predictions)} predictions in {predictions[-1].t - predictions[0].t:.1f} s of the recording')

# %%
# The left plot shows a prediction during the first movement, the right one the likelihoods of the goals during these eight
# seconds, in which the hand moves three times and rests between.

moving = next(prediction for prediction in predictions if prediction.t > predictions[0].t + 1.35)
figure, (scene, likelihoods) = plt.subplots(1, 2, figsize=(11, 5), layout='constrained')
moving.plot(scene)
for goal in moving.goals:
    values = [each.likelihood for prediction in predictions for each in prediction.goals if each.name == goal.name]
    likelihoods.plot([prediction.t - predictions[0].t for prediction in predictions], values, marker='.', label=goal.name)
likelihoods.set(xlabel='time [s]', ylabel='likelihood', ylim=(0.0, 1.05))
likelihoods.legend()
plt.show()
