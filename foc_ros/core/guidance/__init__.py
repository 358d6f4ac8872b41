# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From a prediction to assistance: one hand pose and the newest prediction in, a bounded and passive guiding force out.

May import the types, the config and the obstacles. Pure functions of their arguments and an explicit state; `guide.guide` calls
the others in their order.
"""
