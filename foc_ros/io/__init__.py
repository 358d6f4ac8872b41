"""Files: bags, CSV, YAML and JSON become recordings, scenes and class libraries, and the reverse.

May import `foc_ros.core`; no file is executed, and every error names the file and the reason.
"""
