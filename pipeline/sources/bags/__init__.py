"""Bags: recordings of ROS 1 and ROS 2, read message by message without a ROS installation.

Needs the packages of the extra ``ros``, which are imported when a bag is opened.
"""

from dockpose.sources.bags.bag import Bag

__all__ = ["Bag"]
