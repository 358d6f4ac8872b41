# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Files: bags, CSV, YAML and JSON become recordings, scenes and class libraries, and the reverse.

May import `foc_ros.core`. Loading a file never runs code from it, and every error names the file and the reason.
"""
