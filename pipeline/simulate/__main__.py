"""Render scenes again: ``python -m dockpose.simulate FOLDER`` writes NAME.png and the truth for every NAME.yaml."""

import sys
from pathlib import Path

from dockpose.simulate.files import render_folder

if __name__ == "__main__":
    render_folder(Path(sys.argv[1]))
