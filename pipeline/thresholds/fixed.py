"""A level set by hand, as Park et al. 2009 did."""

from dockpose.thresholds.histogram import Histogram, Threshold, threshold_at


def fixed(histogram: Histogram, level: int | None) -> Threshold:
    """Keep pixels at or above a given level.

    Parameters
    ----------
    histogram : Histogram
        Histogram of the grey picture.
    level : int or None
        Grey level, 0..255.

    Returns
    -------
    Threshold
        That level.

    Raises
    ------
    ValueError
        If the level is None.
    """
    if level is None:
        raise ValueError("level is None; the method 'fixed' needs one")
    return threshold_at("fixed", histogram, level, f"Level {level} was set by hand.")
