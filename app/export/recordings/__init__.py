"""Results of each frame for other programs: as messages of ROS 2, in an MCAP file."""
