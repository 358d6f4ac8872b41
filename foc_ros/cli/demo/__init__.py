"""`demo`: the packaged recording played in real time, over DDS, to the real node in a process of its own."""

from .command import add_arguments, run

__all__ = ['add_arguments', 'run']
