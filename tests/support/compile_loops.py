"""Compile nearly all loops over pixels once, which else each process of the tests does for itself."""

import sys

from dockpose.app.cli import main
from dockpose.sidecar import sample_source

if __name__ == "__main__":
    picture = sample_source("plain")
    sys.exit(main(["compare", picture]) or main(["estimate", picture, picture, "--rate", "10"]))
