"""Reporting: predictions, scores and fits enter; pictures and pages leave.

May import everything below `foc_ros.cli`.
"""
