"""The optimal control problem: a problem and a start enter, a solution with its status leaves.

`problem` and `terms` hold the data, `qp`, `working_set` and `backend` one quadratic programme, `sqp` the sequence of them,
`contacts` the optimality conditions, `strategies` the trade of effort against risk; `solve` puts them together. May import
`foc_ros.core.classes`, `obstacles`, `plant`, `hand` and the ground modules of `foc_ros.core`.
"""
