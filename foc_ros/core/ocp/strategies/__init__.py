"""Strategies: a problem and a start enter; a control that trades effort against risk leaves. One file for each strategy.

May import everything in `foc_ros.core.ocp`.
"""
