"""The numeric core: hand state and scene in, prediction out. Knows numpy and PIQP, never ROS."""
