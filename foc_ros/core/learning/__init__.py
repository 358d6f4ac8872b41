# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Learning: the hand's movements and their predictions enter; what they say about the operator and about the scene leaves.

`learnt` holds all of it: `pace` is how the operator moves and arrives, `dispersion` how large the errors of predictions are, both
by a posterior on a grid (`posterior`), and `movements` which recordings of the scene there are. `recordings` is how recordings
change a prediction. It may import all of `foc_ros.core` but `candidates`, `tracks`, `predict` and the pipeline.
"""
