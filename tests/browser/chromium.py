"""Find a Chromium for the browser tests, or install one: ``python -m tests.browser.chromium``."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
INSTALL_SECONDS = 900


def find() -> str | None:
    """Path of a Chromium: $CHROMIUM, one on the PATH, or playwright's own; None where there is none."""
    named = os.environ.get("CHROMIUM")
    if named:
        return named
    for name in NAMES:
        path = shutil.which(name)
        if path:
            return path
    return _of_playwright()


def install() -> None:
    """Install one: with apt where this is Debian and we are root, elsewhere with playwright."""
    is_root = hasattr(os, "geteuid") and os.geteuid() == 0
    if is_root and shutil.which("apt-get"):
        environment = os.environ | {"DEBIAN_FRONTEND": "noninteractive"}
        _run(["apt-get", "update", "-qq"], environment)
        _run(["apt-get", "install", "-y", "-qq", "--no-install-recommends", "chromium"], environment)
    if find() is None:
        _run([sys.executable, "-m", "playwright", "install", "chromium"], dict(os.environ))


def _of_playwright() -> str | None:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        path = playwright.chromium.executable_path
    return path if path and Path(path).exists() else None


def _run(command: list[str], environment: dict[str, str]) -> None:
    print("running", *command, file=sys.stderr, flush=True)
    try:
        subprocess.run(command, env=environment, timeout=INSTALL_SECONDS, check=False, stdin=subprocess.DEVNULL)
    except (OSError, subprocess.TimeoutExpired) as error:
        print(f"could not: {error}", file=sys.stderr)


def main() -> None:
    """Say which Chromium the browser tests will use, installing one where there is none."""
    if find() is None:
        install()
    found = find()
    if found is None:
        print("No Chromium could be found or installed: the browser tests will be skipped (with CI set, they fail).")
        print("Install one, or set CHROMIUM to its path, and run the tests again.")
    else:
        print(f"Chromium for the browser tests: {found}")


if __name__ == "__main__":
    main()
