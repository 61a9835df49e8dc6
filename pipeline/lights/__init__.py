"""From a threshold to the dock's lights: groups, their centroids, masks, the ring among them, and its ellipse."""

from dockpose.lights.ellipse import Ellipse, NoEllipseError, fit_ellipse

__all__ = ["Ellipse", "NoEllipseError", "fit_ellipse"]
