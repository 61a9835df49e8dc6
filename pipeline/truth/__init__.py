"""Truth from outside: docks that were seen beside a trajectory that motion capture, a gantry or a tag has measured."""

from dockpose.truth.comparison import TrajectoryComparison, compare_trajectory
from dockpose.truth.files import read_trajectory
from dockpose.truth.trajectory import DockTrack, Placement, Trajectory

__all__ = ["DockTrack", "Placement", "Trajectory", "TrajectoryComparison", "compare_trajectory", "read_trajectory"]
