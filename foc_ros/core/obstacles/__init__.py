"""Obstacles: shapes and tables of several sources enter; obstacles at a stamp and the moments of their constraint leave.

It may import the ground modules of `foc_ros.core`.
"""
