"""The 3D view as one HTML file that opens offline."""

from __future__ import annotations

import viser


def scene_html(server: viser.ViserServer) -> bytes:
    """The scene as it stands, viser's viewer included. It takes a moment, and several megabytes."""
    return server.scene.as_html().encode()
