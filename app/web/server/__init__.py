"""What stands between the network and viser: the guarded start, extra pages, capped uploads.

Knows nothing of panels, charts and the scene.
"""
