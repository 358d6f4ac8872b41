"""Estimation: stamped positions of the hand enter; its state, its effort so far and its time to go leave.

It may import the ground modules of `foc_ros.core` (types, config, errors).
"""
