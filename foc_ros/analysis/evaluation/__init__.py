"""Evaluation: recordings and predictions enter; scores beside simple baselines leave."""
