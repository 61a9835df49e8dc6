"""What works on the pixels of a picture: bright ones, the groups that they form at any level, their peaks and squares.

May import `dockpose.compiled`; knows nothing of thresholds and lights.
"""
