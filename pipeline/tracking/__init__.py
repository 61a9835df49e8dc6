"""Tracking a dock over frames: the two pose hypotheses, their chains, and where to search next.

May import `dockpose.estimate` and everything below it.
"""

from dockpose.tracking.tracker import Track, Tracked, Tracker

__all__ = ["Track", "Tracked", "Tracker"]
