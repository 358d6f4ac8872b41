"""Estimation: stamped positions of the hand enter; its state, its effort so far and its time to go leave.

May import the ground modules of `foc_ros.core` (types, config, errors, kernels, linear_algebra).
"""
