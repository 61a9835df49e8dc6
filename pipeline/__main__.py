"""``python -m dockpose``: the program that is installed under that name."""

import sys
from importlib.metadata import entry_points

if __name__ == "__main__":
    (program,) = entry_points(group="console_scripts", name="dockpose")
    sys.exit(program.load()())
