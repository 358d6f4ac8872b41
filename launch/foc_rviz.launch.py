# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Start the node and RViz: `ros2 launch foc_ros foc_rviz.launch.py hand_pose:=/MTMR/measured_cp`.

The arguments are those of foc.launch.py.
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

OUTPUTS = ('prediction', 'path', 'markers')
INPUTS = ('hand_pose', 'goals', 'goal_pose')
"""Topics in the configuration of RViz, which has the node in the root namespace."""


def generate_launch_description() -> LaunchDescription:
    """Return the node and RViz."""
    here = Path(__file__).parent
    namespace = LaunchConfiguration('namespace')
    return LaunchDescription(
        [
            IncludeLaunchDescription(PythonLaunchDescriptionSource(str(here / 'foc.launch.py'))),
            Node(
                package='rviz2',
                executable='rviz2',
                namespace=namespace,
                arguments=['-d', str(here.parent / 'config' / 'foc.rviz')],
                remappings=[
                    *((f'/foc/{name}', f'foc/{name}') for name in OUTPUTS),
                    *((f'/{name}', LaunchConfiguration(name)) for name in INPUTS),
                ],
            ),
        ]
    )
