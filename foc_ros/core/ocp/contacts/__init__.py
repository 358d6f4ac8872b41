"""Contacts: a control that touches obstacles enters; the control that satisfies the optimality conditions there leaves.

May import what `foc_ros.core.ocp` may, and its problem, QP and working set.
"""
