"""The plant: a plant and a number of steps enter; condensed horizons, covariances and predictive covariances leave.

It may import the ground modules of `foc_ros.core`, `hand` and `obstacles`.
"""
