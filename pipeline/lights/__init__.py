"""From a threshold to the lights of the dock: groups, centres, masks, the ring among them, its ellipse.

May import camera and thresholds; knows nothing of poses.
"""
