"""Predict where an operator's hand is going, among obstacles, with its uncertainty."""

__version__ = '0.1.0'
