"""Bags: recordings of ROS 1 and ROS 2, read message by message without a ROS installation.

Needs the packages of the extra ``ros``, which are imported when a bag is opened. The readers of `mcap` and `rosbags`
serve where a file is whole. They refuse files that break off or end there, stop at the first damaged chunk, expand any
size and seek by time alone, so the chunks are gone through here.
"""

from dockpose.sources.bags.bag import Bag

__all__ = ["Bag"]
