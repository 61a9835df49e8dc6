"""Bags: recordings of ROS 1 and ROS 2, read message by message without a ROS installation.

Needs the packages of the extra ``ros``, which are imported when a bag is opened. The readers of `mcap` and `rosbags`
refuse files that break off, stop at the first damaged chunk and expand any size, so a file is gone through once, record
by record, which these libraries parse, and its pictures are then read by their places.
"""
