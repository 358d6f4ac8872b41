"""Messages to records and back. The same functions serve rclpy's messages and those read from a bag with rosbags."""
