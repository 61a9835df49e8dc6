"""Read-ahead: the next frames are decoded while the current one is processed."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterable, Iterator
from typing import TypeVar

Item = TypeVar("Item")
_END = object()


def read_ahead(items: Iterable[Item], at_most: int = 4) -> Iterator[Item]:
    """Yield the items in order, fetched by a thread that is up to ``at_most`` ahead; its errors come in turn."""
    waiting: queue.Queue[tuple[object, BaseException | None]] = queue.Queue(maxsize=at_most)
    stop = threading.Event()

    def put(item: object, error: BaseException | None = None) -> bool:
        while not stop.is_set():
            try:
                waiting.put((item, error), timeout=0.1)
            except queue.Full:
                continue
            return True
        return False

    def run() -> None:
        try:
            for item in items:
                if not put(item):
                    return
        except BaseException as error:  # raised again where the items are consumed
            put(_END, error)
        else:
            put(_END)

    thread = threading.Thread(target=run, name="dockpose reading ahead", daemon=True)
    thread.start()
    try:
        while True:
            item, error = waiting.get()
            if error is not None:
                raise error
            if item is _END:
                return
            yield item  # pyright: ignore[reportReturnType]
    finally:
        stop.set()
        thread.join(timeout=5.0)
