"""Obstacles: sources and shapes enter; the scene at a stamp and the moments of its chance constraint leave.

May import the ground modules of `foc_ros.core`.
"""
