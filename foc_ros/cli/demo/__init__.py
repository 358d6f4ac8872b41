"""`demo`: plays the packaged recording over DDS in real time to the real node, which runs in a process of its own."""

from .command import add_arguments, run

__all__ = ['add_arguments', 'run']
