"""``--log-level`` and ``--log-file`` of every command: one line an event, with nothing secret in it, by ``logging``."""

import argparse
import contextlib
import logging
import re
import sys
import time
from collections.abc import Iterator

from dockpose.app.commands.arguments import add_options
from dockpose.app.errors import writing
from dockpose.text import printable

LEVELS = ("debug", "info", "warning", "error")
# What gives access: our own token, a password in an address, and what others call such things.
_SECRETS = (
    (re.compile(r"([?&;\s](?:\w*token|key|password|secret|sig(?:nature)?)=)[^\s&;\"')]+", re.IGNORECASE), r"\1***"),
    (re.compile(r"(\w://)[^/\s@]+@"), r"\1***@"),
    (re.compile(r"((?:authorization|cookie)\s*[:=]\s*).*", re.IGNORECASE), r"\1***"),
)


def add_logging(parser: argparse.ArgumentParser) -> None:
    """Add ``--log-level`` and ``--log-file``."""
    add_options(parser.add_argument_group("events"), "events", log_level={"choices": LEVELS})


@contextlib.contextmanager
def logged(arguments: argparse.Namespace) -> Iterator[None]:
    """Write events where the arguments of a command say, and nowhere by default, while the context lasts."""
    level, path = getattr(arguments, "log_level", None), getattr(arguments, "log_file", None)
    handler: logging.Handler = logging.NullHandler()
    if path is not None:
        with writing(f"--log-file {path}"):
            handler = logging.FileHandler(path, encoding="utf-8")
    elif level is not None:
        handler = logging.StreamHandler(sys.stderr)
        handler.addFilter(lambda record: not getattr(record, "is_said", False))  # is on standard error already
    handler.setFormatter(OneLine())
    handler.handleError = lambda record: None
    logger = logging.getLogger("dockpose")
    before = logger.level, logger.propagate
    logger.addHandler(handler)
    logger.setLevel((level or "info").upper())
    logger.propagate = False
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.level, logger.propagate = before
        with contextlib.suppress(OSError):
            handler.close()


@contextlib.contextmanager
def warned() -> Iterator[None]:
    """Write warnings of the server and of libraries to standard error meanwhile, unless events go there anyway."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setLevel(logging.WARNING)
    handler.setFormatter(OneLine("dockpose: %(message)s"))
    handler.handleError = lambda record: None
    is_there = any(type(one) is logging.StreamHandler for one in logging.getLogger("dockpose").handlers)
    loggers = [logging.getLogger(name) for name in ("py.warnings", *([] if is_there else ["dockpose.server"]))]
    for logger in loggers:
        logger.addHandler(handler)
    logging.captureWarnings(True)
    try:
        yield
    finally:
        logging.captureWarnings(False)
        for logger in loggers:
            logger.removeHandler(handler)


class OneLine(logging.Formatter):
    """An event as one line: time of day (UTC), level, logger, text; control characters are spelt out."""

    converter = time.gmtime
    default_time_format = "%Y-%m-%dT%H:%M:%S"
    default_msec_format = "%s.%03dZ"

    def __init__(self, form: str = "%(asctime)s %(levelname)s %(name)s: %(message)s") -> None:
        super().__init__(form)

    def format(self, record: logging.LogRecord) -> str:
        """Return the line of an event, a traceback included, without its end."""
        return printable(without_secrets(super().format(record)))


def without_secrets(text: str) -> str:
    """Text in which tokens, passwords and cookies are replaced by ``***``."""
    for pattern, replacement in _SECRETS:
        text = pattern.sub(replacement, text)
    return text
