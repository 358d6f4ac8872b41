"""The hand: stamped positions enter; its state and its time to go leave.

It may import the ground modules of `foc_ros.core` (types, config, errors).
"""
