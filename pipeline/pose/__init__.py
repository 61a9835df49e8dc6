"""From an ellipse and its lights to the two poses, their uncertainty, and the choice between them.

May import `dockpose.camera` and `dockpose.lights`.
"""
