"""Tables and figures of the paper, and the methods it compares with.

May import `dockpose.camera`, `dockpose.lights` and `dockpose.pose`.
"""
