"""A clock that stands still until a test sets it, and waiting by the real one."""

import time


class Clock:
    now_s = 100.0

    def __call__(self):
        return self.now_s


def until(check, timeout_s=60.0):
    """Wait until something is so; True once it is."""
    end_s = time.monotonic() + timeout_s
    while not check():
        assert time.monotonic() < end_s
        time.sleep(0.01)
    return True
