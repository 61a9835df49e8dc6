"""Tracking a dock over frames: the two pose hypotheses, their chains, and where to search next."""

from dockpose.tracking.tracker import NO_TRACK, Track, Tracked, Tracker

__all__ = ["NO_TRACK", "Track", "Tracked", "Tracker"]
