"""A row of an experiment, others like it, and what was measured."""

from typing import Any

import msgspec
from dockpose.app.experiment import Row
from dockpose.app.experiment.record import MEASURED_COLUMNS
from dockpose.pose.known import KnownPose

ROW = Row(
    number=1, time="2026-01-01T00:00:00+00:00", source="tank", file="frames/0001.png", sha256="", status="ok",
    x_cm=1.0, y_cm=2.0, z_cm=100.0, theta_x_deg=10.0, theta_y_deg=-5.0,
)  # fmt: skip


def changed(**fields) -> Row:
    return msgspec.structs.replace(ROW, **fields)


def measured(known: KnownPose | None) -> dict[str, Any]:
    assert known is not None
    numbers = (*(100 * value for value in known.position_m), known.theta_x_deg, known.theta_y_deg)
    return dict(zip(MEASURED_COLUMNS, numbers, strict=False))
