"""The one browser that all benchmarks share."""

from tests.browser.conftest import browser

__all__ = ["browser"]
