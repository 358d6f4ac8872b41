# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Homotopy classes in clutter
===========================

`foc_ros.solve_classes` searches the homotopy classes of a scene and solves each of them. Ten obstacles have up to 1024 patterns
of sides. The search returns the shortest classes without trying all patterns.
"""

import matplotlib.pyplot as plt
import numpy as np

import foc_ros

generator = np.random.default_rng(13)
centres = generator.uniform((0.08, -0.1), (0.32, 0.1), (10, 2))
obstacles = [
    foc_ros.Circle(centre, radius=0.014, radius_stddev=0.001, name=f'o{number}') for number, centre in enumerate(centres)
]
values = {'homotopy.max_candidates': 8, 'foc.eta': 0.8, 'foc.noise_x': 0.02, 'foc.noise_y': 0.02, 'likelihood.beta': 1.0}
config = foc_ros.Config().with_values(values)
candidates = foc_ros.solve_classes((0.0, 0.0), [(0.4, -0.05), (0.4, 0.05)], obstacles, config=config)
for candidate in candidates:
    print(f'{candidate.label:24} {candidate.status.value:16} likelihood {candidate.likelihood:.2f}')

# %%
# A label names the goal, and every obstacle that matters with its side: + if the path passes it on the left, - if on the right.

figure, axes = plt.subplots(figsize=(9, 5.5), layout='constrained')
foc_ros.plot_candidates(candidates, axes)
plt.show()
