# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Start the node: `ros2 launch foc_ros foc.launch.py hand_pose:=/MTMR/measured_cp plane:=xz`."""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

INPUTS = ('hand_pose', 'obstacles', 'obstacle_markers', 'collision_objects', 'detections', 'goals', 'goal_pose')
"""Topics of the node, each of which can be given another name."""
PARAMETERS = {
    'plane': 'task plane: xy, xz or yz',
    'frame_id': 'working frame',
    'autostart': 'true, or false for a lifecycle manager',
}
"""Parameters of the node, which override those of the file."""


def create_node(context: LaunchContext) -> list[Node]:
    """Return the node; a parameter that was not given keeps the value of the file or its default."""
    given = {name: context.launch_configurations[name] for name in ('params_file', *PARAMETERS)}
    file = given.pop('params_file')
    types = {'autostart': bool}
    overrides = {name: ParameterValue(value, value_type=types.get(name, str)) for name, value in given.items() if value}
    return [
        Node(
            package='foc_ros',
            executable='foc_node',
            name='foc',
            namespace=LaunchConfiguration('namespace'),
            parameters=[*([file] if file else []), *([overrides] if overrides else [])],
            remappings=[(name, LaunchConfiguration(name)) for name in INPUTS],
            output='screen',
        )
    ]


def generate_launch_description() -> LaunchDescription:
    """Return the arguments and the node."""
    return LaunchDescription(
        [
            DeclareLaunchArgument('namespace', default_value='', description='namespace of the node and of relative topics'),
            DeclareLaunchArgument('params_file', default_value='', description='parameter file, such as config/foc.yaml'),
            *(DeclareLaunchArgument(name, default_value='', description=words) for name, words in PARAMETERS.items()),
            *(DeclareLaunchArgument(name, default_value=name, description=f'topic of the input {name}') for name in INPUTS),
            OpaqueFunction(function=create_node),
        ]
    )
