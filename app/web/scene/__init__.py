"""The 3D scene: camera, candidate docks, known poses, and the viewpoints on them."""
