"""Charts of the page: each turns data into the series of one uplot.

May import processing and drawing; knows nothing of panels.
"""
