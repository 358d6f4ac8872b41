# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The program `foc_ros`, also as `python -m foc_ros COMMAND`.

The node needs ROS and a numeric library or two; the other commands need more. What of it is missing is said in one sentence.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.util import find_spec

COMMANDS_NEED = ('cyclopts', 'joblib', 'mcap', 'pydantic', 'rich', 'rosbags')
"""Packages of the commands that the node does without."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return the exit code; arguments: those of the process by default, without its name."""
    missing = [name for name in COMMANDS_NEED if find_spec(name) is None]
    if not missing:
        from .cli.main import main as run

        return run(arguments)
    given = list(sys.argv[1:] if arguments is None else arguments)
    if given[:1] == ['node'] and find_spec('rclpy') is not None:
        from .ros.main import main as run_node

        return run_node(given[1:])
    names = ' '.join(missing)
    print(f'foc_ros: this command needs packages that are not installed: pip install {names}', file=sys.stderr)
    return 2


if __name__ == '__main__':
    sys.exit(main())
