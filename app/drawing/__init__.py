"""Pictures of a result: annotated, thresholded or side by side, as pixels or as vectors.

Holds the one table of colours and the one set of number formats. May import inputs and the library only.
"""
