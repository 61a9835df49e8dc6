import re

import pytest
from dockpose.app.web.server.pages import help_page, own_pages

SECTIONS = (
    *("view", "annotated", "threshold", "compare"),
    *("tank", "source", "detect", "pose", "log", "export", "study", "page"),
)


@pytest.mark.parametrize("name", SECTIONS)
def test_help_has_the_section_that_a_tab_leads_to(name):
    (text,) = re.findall(rf'<h2 id="{name}">.*?</h2>(.*?)(?=<h2|</main>)', help_page(), re.DOTALL)
    assert len(text.split()) > 10


def test_the_help_says_what_the_study_found():
    pages = own_pages()
    text = pages["/help"].body.decode()
    assert "simulated scenes of seed" in text
    assert "study.html" not in text
