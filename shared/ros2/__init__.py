"""ROS 2 without ROS: nodes of rmw_zenoh's convention on Zenoh, ROS 2's middleware on new robots.

A process that keeps the convention is a node for all others: `ros2 topic list` shows it. Jazzy,
Kilted and Lyrical speak it; Humble has no type hashes. Source: github.com/ros2/rmw_zenoh.
"""
