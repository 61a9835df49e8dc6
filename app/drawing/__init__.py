"""Pictures of a result: annotated, thresholded, side by side, as pixels or as vectors, with one table of colours.

May import inputs and the library only.
"""
