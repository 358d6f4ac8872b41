# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
The damped mass
===============

The default plant of the hand is a triple integrator, which is driven by jerk. The plant `damped_mass` is driven by force: it is
the second-order plant of the paper's discussion. The parameter `foc.plant` selects it, here and in the node.
"""

import matplotlib.pyplot as plt
import numpy as np

import foc_ros

obstacles = [foc_ros.Circle((0.14, -0.01), radius=0.03, radius_stddev=0.003)]
plants = {
    'triple integrator': {},
    'damped mass, 2 N s/m': {'foc.plant': 'damped_mass', 'foc.plant_mass': 1.0, 'foc.plant_damping': 2.0},
    'damped mass, 20 N s/m': {'foc.plant': 'damped_mass', 'foc.plant_mass': 1.0, 'foc.plant_damping': 20.0},
}

# %%
# A force may change at once, so that the damped mass starts with an acceleration. The triple integrator starts smoothly.

figure, (paths, speeds) = plt.subplots(1, 2, figsize=(11, 3.6), width_ratios=(1.5, 1), layout='constrained')
paths.add_patch(plt.Circle(obstacles[0].centre, obstacles[0].radius, color='0.7'))
for name, values in plants.items():
    config = foc_ros.Config().with_values(values)
    solution = foc_ros.solve((0.0, 0.0), (0.3, 0.0), obstacles, eta=0.9, strategy='optimal', config=config)
    print(f'{name}: {solution.mean.shape[1]} states, {solution.status.value}')
    paths.plot(*solution.path.T, label=name)
    speeds.plot(solution.times, np.hypot(*solution.mean[:, 2:4].T), label=name)
paths.set(xlabel='x [m]', ylabel='y [m]', aspect='equal')
speeds.set(xlabel='time [s]', ylabel='speed [m/s]')
speeds.legend()
plt.show()
