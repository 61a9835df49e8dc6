"""Results as messages of ROS 2: in YAML, in an MCAP file, and from a node. Needs no ROS but for the node itself."""
