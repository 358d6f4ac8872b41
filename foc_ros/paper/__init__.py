"""`paper`: the studies of the paper's section on simulations, redone, and one that it could not have."""

from .command import add_arguments, run

__all__ = ['add_arguments', 'run']
