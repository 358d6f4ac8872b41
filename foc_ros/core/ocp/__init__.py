"""The optimal control problem: a problem and a start enter, a solution with its status leaves.

May import `foc_ros.core.homotopy`, `obstacles`, `dynamics`, `estimation` and the ground modules.
"""
