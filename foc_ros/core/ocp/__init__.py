"""The optimal control problem: a problem and a start enter, a solution with its status leaves.

`problem` holds the data, `margin` says by how much a movement clears the obstacles, `objective` what it costs, and `qp` and
`backend` solve one quadratic programme. `solver` is the sequence of them, `strategies` and `lv_hc` trade effort against risk,
and `solve` evaluates what they find; `monte_carlo` checks it by noisy movements. May import `foc_ros.core.classes`, `obstacles`,
`plant`, `hand` and the ground modules of `foc_ros.core`.
"""
