"""A node of ROS 2 that publishes where the dock is: the command, the node, and its logic, which knows no ROS."""
