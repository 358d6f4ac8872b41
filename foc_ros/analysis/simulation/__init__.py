"""The closed-loop study: simulated operators among obstacles, with and without assistance, and what becomes of them.

Operators know nothing of the predictor's model. May import the core, recordings and the parallel execution of `analysis`.
"""
