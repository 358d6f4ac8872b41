# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The closed-loop study: simulated operators among obstacles, with and without assistance, and what becomes of them.

Operators know nothing of the predictor's model.
"""

ACCURATE, NOISY, LAGGY = 'accurate', 'noisy', 'laggy'
CHANGES_WAY, UNANNOUNCED_GOAL, HUMAN_PATHS = 'changes_way', 'unannounced_goal', 'human_paths'
OPERATORS = (ACCURATE, NOISY, LAGGY, CHANGES_WAY, UNANNOUNCED_GOAL, HUMAN_PATHS)
NONE, FOC = 'none', 'foc'
ASSISTANCE = (NONE, FOC)
