# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The command lines that the documentation shows, and those of them that a test cannot run, each with its reason.

Every line of a block marked `console`, in README, CONTRIBUTING and doc/, runs as it stands, page by page and in order, unless
NOT_RUN lists it. Lines of ENDLESS run until they are interrupted. A line that is listed and no longer shown is an error, too.
"""

import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGES = sorted([ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', *(ROOT / 'doc').glob('*.md')])

SUDO, ROOT_OR_NETWORK = 'needs root', 'needs root or the network'
ROS = 'needs the commands of a ROS installation'
BY_CI = '.ci/run runs this line'
LONG = 'takes minutes'
PARTLY, REPLAYED = f'{LONG}; test_simulation.py runs a part', f'{LONG}; test_benchmarks.py measures a part'
FIT = 'takes minutes; test_fit.py and test_evaluate.py run it with few predictions'
LAUNCH = 'ros2launch is not a package of the index; test_launch.py starts the files where launch_ros is installed'
SHELL = 'the program is on the path of the test already'
NOT_RUN = {
    # README
    'make setup': BY_CI,
    'make demo': 'takes half a minute; test_demo.py plays the recording',
    'echo "yaml file://$PWD/src/foc_ros/rosdep/foc_ros.yaml" | sudo tee /etc/ros/rosdep/sources.list.d/10-foc_ros.list': SUDO,
    'rosdep update && rosdep install --from-paths src --ignore-src': ROOT_OR_NETWORK,
    'colcon build --packages-select foc_ros': 'scripts/colcon_check runs this line',
    'source install/setup.bash': 'scripts/colcon_check runs this line',
    'ros2 run foc_ros foc_node --ros-args -r hand_pose:=/MTMR/measured_cp -r obstacles:=/perception/obstacles '
    '--params-file install/foc_ros/share/foc_ros/config/foc.yaml': 'scripts/colcon_check starts the same program',
    'python3 -m venv venv && . venv/bin/activate': ROOT_OR_NETWORK,
    "pip install '.[ros,report]'": ROOT_OR_NETWORK,
    'export AMENT_PREFIX_PATH=$VIRTUAL_ENV': SHELL,
    'foc_ros evaluate bags --report evaluation': FIT,
    'foc_ros fit recordings --output operator.yaml': FIT,
    # calibrate
    'foc_ros fit recordings --params foc.yaml --output operator.yaml': FIT,
    'foc_ros evaluate recordings --params operator.yaml --report report': FIT,
    'foc_ros node --ros-args --params-file operator.yaml': 'test_fit.py starts the node with the fitted parameters',
    # play
    'foc_ros play': 'runs until it is stopped, on a fixed port; test_play_browser.py starts it on a free one',
    'foc_ros fit play_data/SESSION/unguided --params play_data/SESSION/parameters.yaml --output operator.yaml '
    '--allow positions': FIT,
    'foc_ros evaluate play_data/SESSION/unguided --params operator.yaml': FIT,
    # start
    '. .venv/bin/activate': SHELL,
    # beside_a_stack
    "ros2 service call /foc/engage std_srvs/srv/SetBool '{data: false}'": f'{ROS}; test_node_process.py makes the same calls',
    "ros2 service call /foc/engage std_srvs/srv/SetBool '{data: true}'": f'{ROS}; test_node_process.py makes the same calls',
    'ros2 param set /teleoperation obstacles false': f'{ROS}; test_node_process.py makes the same calls',
    'ros2 param set /teleoperation obstacles true': f'{ROS}; test_node_process.py makes the same calls',
    'ros2 launch foc_ros foc.launch.py hand_pose:=/MTMR/measured_cp obstacles:=/perception/obstacles plane:=xz': LAUNCH,
    'ros2 launch foc_ros two_arms.launch.py left_hand:=/MTML/measured_cp right_hand:=/MTMR/measured_cp': LAUNCH,
    'ros2 launch foc_ros foc_rviz.launch.py hand_pose:=/MTMR/measured_cp': LAUNCH,
    'ros2 security create_keystore keystore': ROS,
    'ros2 security create_enclave keystore /foc': ROS,
    'ros2 security create_permission keystore /foc sros2_policy.xml': ROS,
    'export ROS_SECURITY_KEYSTORE=$PWD/keystore ROS_SECURITY_ENABLE=true ROS_SECURITY_STRATEGY=Enforce': ROS,
    'ros2 run foc_ros foc_node --ros-args --enclave /foc': ROS,
    # measuring
    'make people': f'{LONG}, and needs recordings that are not part of the checkout',
    '.venv/bin/python scripts/flicker.py': REPLAYED,
    '.venv/bin/python benchmarks/accuracy.py': f'{LONG}; test_documentation.py checks the page',
    # guidance
    'foc_ros simulate --trials 200': PARTLY,
    # CONTRIBUTING
    'make check': BY_CI,
    'make test': BY_CI,
    'make test-long': BY_CI,
    'make lint': BY_CI,
    'make doc': BY_CI,
    'make bench': LONG,
    'make colcon': BY_CI,
    'make dist': BY_CI,
    'scripts/tf2_check': 'clones and compiles tf2; run it before a release',
    'make stress': LONG,
    '.ci/run': 'it runs this test',
}
ENDLESS = (
    'foc_ros node --ros-args -r hand_pose:=/MTMR/measured_cp',
    'foc_ros node --ros-args -r hand_pose:=/MTMR/measured_cp -r obstacles:=/perception/obstacles -p plane:=xz',
    'foc_ros node --ros-args -r obstacles:=/camera/obstacles -p frame_id:=world -p frames.tolerance_s:=0.1',
    'foc_ros node --ros-args -r hand_pose:=/servo_node/pose_target_cmds -p guidance.enabled:=true '
    '-r command_twist:=/joy/twist -r foc/guidance/twist:=/servo_node/delta_twist_cmds',
    'python doc/examples/teleoperation_loop.py',
)
KNOWN_BLOCKS = ('console', 'python', 'yaml', 'text', '{toctree}', '{eval-rst}')


def find_commands(page: Path) -> Iterator[str]:
    """Yield the command lines of a page; continued lines are joined, comments are removed."""
    for block in re.findall(r'^```console\n(.*?)^```', page.read_text('utf-8'), re.MULTILINE | re.DOTALL):
        for line in re.sub(r'\s*\\\n\s*', ' ', block).splitlines():
            command = re.sub(r'(^|\s+)#.*$', '', line).strip()
            if command:
                yield command


def find_unknown_blocks(page: Path) -> list[str]:
    """Return the kinds of blocks of a page that are unknown, and might contain commands that are not run."""
    kinds = re.findall(r'^```([^\n`]*)\n(?:.*?)^```', page.read_text('utf-8'), re.MULTILINE | re.DOTALL)
    return [kind for kind in kinds if kind not in KNOWN_BLOCKS]
