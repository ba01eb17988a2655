"""Node of ROS 2 that shows the cell and, if that is allowed, takes goals and commands."""
