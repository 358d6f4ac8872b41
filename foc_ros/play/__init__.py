# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`play`: a page in the browser on which a user steers the hand while the predictor runs behind it.

Messages of the page enter, and predictions, forces, scores and bags leave. Imports `reporting` and what is below it; only `cli`
imports this folder.
"""
