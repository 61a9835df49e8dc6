"""Threshold methods that are there for the time of a test."""

import contextlib
from collections.abc import Callable, Iterator
from unittest.mock import patch

from dockpose import register_threshold
from dockpose.thresholds import METHODS


@contextlib.contextmanager
def registered(**methods: tuple[str, Callable]) -> Iterator[None]:
    """Register functions by their names, each with its title, and forget them afterwards."""
    with patch.dict(METHODS):
        for name, (title, function) in methods.items():
            register_threshold(name, title=title)(function)
        yield
