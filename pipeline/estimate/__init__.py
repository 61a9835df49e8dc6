"""The flow chart, from a picture to its poses; and what was found, as an object that describes and draws itself."""

from dockpose.estimate.flow import estimate
from dockpose.estimate.result import SCHEMA, Estimate
from dockpose.settings import Settings

__all__ = ["SCHEMA", "Estimate", "Settings", "estimate"]
