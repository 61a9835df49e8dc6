"""What is measured once, before the estimates: the camera, from pictures of a board, and the dock's lights."""
