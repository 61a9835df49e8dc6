"""From an ellipse and its lights to the two poses, their uncertainty, and the choice between them."""

from dockpose.pose.choice import Choice
from dockpose.pose.circle import CirclePose, circle_poses
from dockpose.pose.solve import find_poses

__all__ = ["Choice", "CirclePose", "circle_poses", "find_poses"]
