# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
One scene solved
================

`foc_ros.solve` finds the movement from a start to a goal that avoids all obstacles with the probability eta. The result contains
the mean and the covariance of the state at every step.
"""

import matplotlib.pyplot as plt
import numpy as np

import foc_ros

obstacles = [
    foc_ros.Circle((0.10, 0.02), radius=0.025, radius_stddev=0.003, name='cup'),
    foc_ros.Circle((0.19, -0.025), radius=0.02, radius_stddev=0.002, name='jar'),
]
solution = foc_ros.solve(start=(0.0, 0.0), goal=(0.3, 0.0), obstacles=obstacles, eta=0.9, strategy='lv', duration_s=1.0)
print(solution.label, solution.status.value, f'effort {solution.effort:.0f} m^2/s^6, eta {solution.eta:.3f}')

# %%
# The left plot shows the mean path with ellipses of one standard deviation. The right plot shows the speed and the standard
# deviation of the position. The hand is fastest behind the cup: noise grows with the effort, and adds up with the time.

figure, (scene, speeds) = plt.subplots(1, 2, figsize=(11, 3.6), width_ratios=(1.7, 1), layout='constrained')
solution.plot(scene)
speeds.plot(solution.times, np.hypot(*solution.mean[:, 2:4].T), label='speed [m/s]')
deviation = np.sqrt(solution.covariance[:, 1, 1])
speeds.plot(solution.times, 100 * deviation, label='standard deviation of y [cm]')
speeds.set(xlabel='time [s]', ylim=(0.0, None))
speeds.legend()
plt.show()
