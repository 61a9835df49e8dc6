"""How many of so many pictures a figure that is reached asks for, less what chance takes in one of a thousand runs."""

from scipy.stats import binom

_CHANCE = 0.001


def at_least(share: float, count: int) -> int:
    """Fewest of ``count`` that a share of all leaves to chance."""
    return int(binom.ppf(_CHANCE, count, share)) if share < 1 else count


def at_most(share: float, count: int) -> int:
    """Most of ``count`` that a share of all leaves to chance."""
    return int(binom.ppf(1 - _CHANCE, count, share)) if share > 0 else 0
