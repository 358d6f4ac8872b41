"""`evaluate`: how well predictions meet recordings of people, beside simple baselines."""

from .command import add_arguments, run

__all__ = ['add_arguments', 'run']
