"""Calibration on the page: boards gathered from what is shown and from uploads, and the camera they make."""
