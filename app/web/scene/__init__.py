"""The 3D scene: camera, candidate docks, known poses, and the viewpoints on them.

May import widgets and charts' neighbours in no folder: only state, drawing and the library.
"""
