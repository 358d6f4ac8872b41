"""Files: bags, CSV, YAML and JSON enter and leave as recordings, scenes and class libraries.

May import `foc_ros.core`.
"""
