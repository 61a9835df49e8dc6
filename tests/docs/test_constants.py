"""The table of chosen numbers has the code's."""

import importlib
import re

from tests.docs.pages import DOCS

ROWS = re.findall(r"^\| `([\w.]+)` \| (\S+) \|", (DOCS / "method.md").read_text(encoding="utf-8"), re.MULTILINE)


def test_each_number_is_the_code_s():
    assert len(ROWS) > 20
    for name, value in ROWS:
        module, constant = name.rsplit(".", 1)
        assert float(value) == getattr(importlib.import_module(f"dockpose.{module}"), constant), name
