# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
A batch of many scenes
======================

Studies need many scenes. This example solves eight random scenes with two strategies and compares their efforts. Expected
failures are a status and not an exception, so that a batch never stops at a difficult scene.
"""

from collections import Counter

import matplotlib.pyplot as plt
import numpy as np

import foc_ros

config = foc_ros.Config().with_values({'foc.noise_x': 0.1, 'foc.noise_y': 0.1, 'homotopy.max_candidates': 4})


def make_scene(seed: int) -> list[foc_ros.Circle]:
    """Return one to four random obstacles between the start and the goal."""
    generator = np.random.default_rng(seed)
    count = generator.integers(1, 5)
    centres = generator.uniform((0.08, -0.06), (0.24, 0.06), (count, 2))
    return [foc_ros.Circle(centre, generator.uniform(0.012, 0.025), 0.002) for centre in centres]


scenes = [make_scene(seed) for seed in range(8)]
results = {
    strategy: [foc_ros.solve((0.0, 0.0), (0.32, 0.0), scene, eta=0.9, strategy=strategy, config=config) for scene in scenes]
    for strategy in ('lv', 'optimal')
}
for strategy, solutions in results.items():
    print(strategy, dict(Counter(solution.status.value for solution in solutions)))

# %%
# The ratio is shown for those scenes in which both strategies find a solution in the same homotopy class.

ratios = [
    slow.effort / best.effort
    for slow, best in zip(results['lv'], results['optimal'], strict=True)
    if slow.status is best.status is foc_ros.Status.SOLVED and slow.label == best.label
]
figure, axes = plt.subplots(figsize=(6.5, 4), layout='constrained')
axes.hist(ratios, bins=24)
axes.set(xlabel='effort of lv / effort of optimal', ylabel='number of scenes')
plt.show()
