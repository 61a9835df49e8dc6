"""Render scenes again: ``python -m dockpose.simulate FOLDER`` makes NAME.png and the truth of every NAME.yaml in it."""

from __future__ import annotations

import sys
from pathlib import Path

from dockpose.simulate.files import render_folder

if __name__ == "__main__":
    render_folder(Path(sys.argv[1]))
