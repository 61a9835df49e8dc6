import pytest
from dockpose.app.web.app import App


@pytest.fixture(scope="module")
def app():
    """The page, at any free port."""
    with App.build(port=0) as running:
        yield running
