"""The page's first sample, as it opens and with what is found in it; nothing changes a view."""

import pytest
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.view import open_source


@pytest.fixture(scope="session")
def view():
    return open_source(None, None, None)


@pytest.fixture(scope="session")
def analysis(view):
    return analyse(view)


@pytest.fixture(scope="session")
def found(analysis):
    return analysis.estimate
