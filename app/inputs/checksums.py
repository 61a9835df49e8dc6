"""The checksum of the file that a shown picture came from."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
from dockpose.app.inputs.folder import Shelf, below
from dockpose.app.resources import sample_path
from dockpose.app.state.view import View
from dockpose.camera.image import decode


class Checksums:
    """Knows where the page's pictures come from.

    Parameters
    ----------
    shelf : the uploaded pictures.
    root : the folder on this machine that may be shown; None for none.
    """

    def __init__(self, shelf: Shelf, root: Path | None) -> None:
        self._shelf, self._root = shelf, root
        self._last: tuple[np.ndarray | None, str | None] = (None, None)

    def sha256(self, view: View) -> str | None:
        """SHA-256 of the file that holds the picture of a view, pixel by pixel; None where there is no such file.

        A frame of a sequence and a simulated picture have none; nor has a file that is gone or was changed meanwhile.
        """
        image, known = self._last
        if image is not view.image:
            known = self._look_up(view)
            self._last = view.image, known
        return known

    def _look_up(self, view: View) -> str | None:
        try:
            data = self._bytes(view)
            if data is None or not np.array_equal(decode(data, view.source), view.image):
                return None
        except (OSError, ValueError):
            return None
        return hashlib.sha256(data).hexdigest()

    def _bytes(self, view: View) -> bytes | None:
        if view.list_name == "samples":
            return sample_path(view.item).read_bytes()
        if view.list_name == "uploads":
            return self._shelf.get(view.item)
        if view.list_name == "folder" and self._root is not None:
            return below(self._root, view.item).read_bytes()
        return None
