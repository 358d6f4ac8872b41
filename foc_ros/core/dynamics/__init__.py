"""Dynamics: a plant and a number of steps enter; condensed responses, variances and predictive covariances leave.

May import the ground modules of `foc_ros.core` and `foc_ros.core.estimation`.
"""
