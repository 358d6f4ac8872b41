"""The numeric core: a hand state and a scene enter, a prediction leaves.

It may import NumPy, PIQP and its own modules. It knows no ROS, no files and no plots.
"""
