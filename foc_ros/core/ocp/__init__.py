# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The optimal control problem: a problem and a start enter, a solution with its status leaves.

`problem` holds the data. `margin` says by how much a movement clears the obstacles, `minima` where it is least in time,
`gradients` how it changes with the control, and `objective` what the movement costs. `qp` and `backend` solve one quadratic
programme, and `solver` is the sequence of them, on its `iterates`. `point` solves problems at one (k, tau, lambda) from their
`start`, `strategies` and `lv_hc` choose it, and `solve` evaluates what they find; `monte_carlo` checks it by noisy movements.
May import `foc_ros.core.classes`, `obstacles`, `plant`, `hand` and the ground modules of `foc_ros.core`.
"""
