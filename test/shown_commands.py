# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command lines that the documentation shows, and those of them that a test cannot run, each with its reason.

Every line of a block marked `console`, in README, CONTRIBUTING and doc/, runs as it stands, page by page and in order, unless
a shell pattern of NOT_RUN matches it. Lines that a pattern of ENDLESS matches run until they are interrupted. A pattern that
matches no line that is shown is an error, too.
"""

import re
from collections.abc import Iterable, Iterator
from fnmatch import fnmatchcase
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGES = sorted([ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', *(ROOT / 'doc').glob('*.md')])

NOT_RUN = {
    'make *': '.ci/run runs those that decide over a change; bench, people, stress and demo take minutes',
    '.ci/run': 'it runs this test',
    'scripts/tf2_check': 'clones and compiles tf2; run it before a release',
    '.venv/bin/python *': 'takes minutes; test_benchmarks.py measures a part',
    'echo "yaml *| sudo tee *': 'needs root',
    'rosdep *': 'needs root or the network',
    'colcon build *': 'scripts/colcon_check runs this line',
    'source install/setup.bash': 'scripts/colcon_check runs this line',
    'python3 -m venv *': 'needs the network',
    'pip install *': 'needs the network',
    'export *': 'the environment of the test has it, or it is for the commands of a ROS installation',
    '. .venv/bin/activate': 'the program is on the path of the test already',
    'ros2 *': 'needs a ROS installation; test_launch.py, test_node_process.py and scripts/colcon_check do the same',
    'foc_ros evaluate *': 'takes minutes; test_evaluate.py runs it with few predictions',
    'foc_ros fit *': 'takes minutes; test_fit.py runs it with few predictions, and the node with the parameters that it writes',
    'foc_ros node --ros-args --params-file operator.yaml': 'needs the output of a fit',
    'foc_ros play': 'runs until it is stopped, on a fixed port; test_play_browser.py starts it on a free one',
    'foc_ros simulate *': 'takes minutes; test_simulation.py runs a part',
}
ENDLESS = 'foc_ros node *[!&]', 'python doc/examples/teleoperation_loop.py'
KNOWN_BLOCKS = ('console', 'python', 'yaml', 'text', '{toctree}', '{eval-rst}')


def find_commands(page: Path) -> Iterator[str]:
    """Yield the command lines of a page; continued lines are joined, comments are removed."""
    for block in re.findall(r'^```console\n(.*?)^```', page.read_text('utf-8'), re.MULTILINE | re.DOTALL):
        for line in re.sub(r'\s*\\\n\s*', ' ', block).splitlines():
            command = re.sub(r'(^|\s+)#.*$', '', line).strip()
            if command:
                yield command


def is_listed(command: str, patterns: Iterable[str]) -> bool:
    return any(fnmatchcase(command, pattern) for pattern in patterns)


def find_unknown_blocks(page: Path) -> list[str]:
    """Return the kinds of blocks of a page that are unknown, and might contain commands that are not run."""
    kinds = re.findall(r'^```([^\n`]*)\n(?:.*?)^```', page.read_text('utf-8'), re.MULTILINE | re.DOTALL)
    return [kind for kind in kinds if kind not in KNOWN_BLOCKS]
