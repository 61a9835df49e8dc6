"""A row of an experiment, and others like it."""

import msgspec
from dockpose.app.experiment import Row

ROW = Row(
    number=1, time="2026-01-01T00:00:00+00:00", source="tank", file="frames/0001.png", sha256="", status="ok",
    x_cm=1.0, y_cm=2.0, z_cm=100.0, theta_x_deg=10.0, theta_y_deg=-5.0,
)  # fmt: skip


def changed(**fields) -> Row:
    return msgspec.structs.replace(ROW, **fields)
