"""Cameras and the images they take: intrinsics, lenses, ports, files, calibration, image decoding.

The lowest folder of the library: may import `dockpose.checks` only.
"""
