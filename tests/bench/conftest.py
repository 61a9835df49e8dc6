"""What benches share: the one browser, and a pool of two processes."""

from multiprocessing import get_context

import pytest

from tests.browser.conftest import browser

__all__ = ["browser"]


@pytest.fixture(scope="module")
def pool():
    with get_context("spawn").Pool(2) as pool:
        yield pool
