"""Contacts: a control near obstacles enters; the control that meets the optimality conditions there, with its contacts, leaves.

May import the problem, QP and working set of `foc_ros.core.ocp`, and what that package may import.

A contact is a place where an obstacle holds the mean off: an obstacle, a time, and a multiplier. With rows at the steps only, the
mean is held at one pair of steps or the next. As eta grows and the hand slows down, the place of contact passes from one pair
to the next, and the effort jumps, although the problem has changed by little. Here contacts are therefore not tied to steps: the
mean between two steps is interpolated (`hermite`), and the time of each contact is an unknown like its multiplier, so that the
contact slides along its obstacle. A Newton iteration solves for both (`newton`); contacts whose multiplier becomes negative are
released, and obstacles that the mean penetrates become contacts (`active_set`), until the point satisfies the Karush-Kuhn-Tucker
conditions in its homotopy class (`kkt_point`).
"""
