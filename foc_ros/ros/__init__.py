"""The ROS 2 node: messages enter, messages leave.

May import `foc_ros.io` and `foc_ros.core`; only this folder imports rclpy.
"""
