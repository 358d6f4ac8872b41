# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Likelihoods over eta
====================

The likelihood of a homotopy class follows from the ratio of the efforts. This example solves all classes of one scene for
increasing eta. The detours become wider and their efforts grow faster, so that the short path becomes more likely.
"""

import matplotlib.pyplot as plt
import numpy as np

import foc_ros

obstacles = [
    foc_ros.Circle((0.12, 0.035), radius=0.03, radius_stddev=0.003, name='cup'),
    foc_ros.Circle((0.16, -0.055), radius=0.03, radius_stddev=0.003, name='jar'),
]
config = foc_ros.Config().with_values(
    {'homotopy.max_candidates': 3, 'foc.noise_x': 0.1, 'foc.noise_y': 0.1, 'likelihood.beta': 1.0}
)
etas = np.linspace(0.5, 0.95, 19)
results = [foc_ros.solve_classes((0.0, 0.0), (0.3, 0.0), obstacles, eta=eta, strategy='optimal', config=config) for eta in etas]

# %%
# Up to an eta of 0.75 the straight line is safe enough between the obstacles, and its effort stays the same.

figure, (scene, efforts, likelihoods) = plt.subplots(1, 3, figsize=(12, 3.6), width_ratios=(1.5, 1, 1), layout='constrained')
foc_ros.plot_candidates(results[len(etas) // 2], scene)
for label in sorted({candidate.label for result in results for candidate in result}):
    found = [{candidate.label: candidate for candidate in result}.get(label) for result in results]
    known = [candidate is not None and candidate.has_likelihood for candidate in found]
    efforts.plot(etas, [each.effort if ok else np.nan for each, ok in zip(found, known, strict=True)], label=label)
    likelihoods.plot(etas, [each.likelihood if ok else 0.0 for each, ok in zip(found, known, strict=True)], label=label)
efforts.set(xlabel='eta', ylabel='effort [m²/s⁶]', yscale='log')
likelihoods.set(xlabel='eta', ylabel='likelihood', ylim=(0.0, 1.0))
likelihoods.legend()
plt.show()
