"""The numeric core: a hand state and a scene enter, a prediction leaves.

It may import NumPy, Numba, PIQP and its own modules; it knows no ROS, no files and no plots.
"""
