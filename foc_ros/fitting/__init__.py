"""`fit`: the parameters that explain an operator's recordings best."""

from .command import add_arguments, run

__all__ = ['add_arguments', 'run']
