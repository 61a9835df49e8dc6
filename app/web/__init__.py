"""The page in the browser, built on viser: the app, its layout, panels, charts, 3D scene and guarded server."""
