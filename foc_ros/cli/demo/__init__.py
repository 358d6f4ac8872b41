"""`demo`: plays the packaged recording over DDS in real time to the real node, which runs in a process of its own."""

from .command import run

__all__ = ['run']
