"""Compiling loops over pixels with numba, and keeping what was compiled wherever that is possible."""

import contextlib
import hashlib
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import cache, partial
from pathlib import Path
from typing import Any

import numba
from numba.core import config, event
from numba.core.caching import IndexDataCacheFile
from numba.core.runtime.nrt import rtsys

# Division by zero gives infinity, not an exception; and no C code calls the loops.
_HOW: dict[str, Any] = {"error_model": "numpy", "no_cfunc_wrapper": True}
_ROOT = Path(__file__).parent  # of all compiled functions
# Versions whose machine code was seen to run without numba's tables of what it can compile.
_IS_TRIED = (0, 61) <= numba.version_info.short <= (0, 68)


def _load_without_blas() -> None:
    """Load numba's functions of arrays, but not SciPy's BLAS with them: that takes long, and no loop needs it."""
    with contextlib.suppress(ImportError, AttributeError):
        from numba.np import linalg

        ensure = linalg.ensure_blas
        setattr(linalg, "ensure_blas", lambda: None)  # noqa: B010
        try:
            import numba.np.arraymath  # noqa: F401  # which asks for it
        finally:
            setattr(linalg, "ensure_blas", ensure)  # noqa: B010


_load_without_blas()


def compiled(loop: Callable[..., Any], **more: Any) -> Any:
    """Compile a function on its first call, and keep the result where possible; not with ``NUMBA_DISABLE_JIT``."""
    if config.DISABLE_JIT:  # type: ignore[attr-defined]
        return loop
    try:
        return _kept(loop, _HOW | more)
    except RuntimeError:  # numba found no folder that can be written
        return numba.njit(**(_HOW | more))(loop)


def compiled_bare(loop: Callable[..., Any], **more: Any) -> Any:
    """Compile a loop that makes no arrays, and so need not count who holds them, which takes longer than many do."""
    return compiled(loop, _nrt=False, **more)


def compiled_sum(loop: Callable[..., Any]) -> Any:
    """Compile a sum whose terms may be added in any order, several at a time, which rounds otherwise."""
    return compiled_bare(loop, fastmath={"reassoc", "contract"})


def compiled_least(loop: Callable[..., Any]) -> Any:
    """Compile a search for a least number among finite ones, several at a time, that makes no arrays."""
    return compiled_bare(loop, fastmath={"nnan", "nsz", "reassoc", "contract"})


def compiled_within(loop: Callable[..., Any]) -> Any:
    """Compile a function as part of the only loop that calls it, which takes less time than both."""
    return compiled(loop, inline="always")


def _kept(loop: Callable[..., Any], how: dict[str, Any]) -> Any:
    """Compile on the first call and keep the result, unless the disk is full then, which must not end the run."""
    function: Any = numba.njit(cache=True, **how)(loop)
    # Numba's own stamp leaves out what a function calls, though it is compiled in; and its versions share one index.
    cache = function._cache
    name, stamp = f"{cache._impl.filename_base}-{numba.__version__}", stamp_of_sources(_ROOT)
    cache._cache_file = IndexDataCacheFile(cache.cache_path, name, stamp)
    cache._cache_file._version = stamp  # read first: the rest may be of types that other sources had
    keep = cache.save_overload

    def keep_if_there_is_room(signature: Any, data: Any) -> None:
        with contextlib.suppress(OSError):
            keep(signature, data)

    cache.save_overload = keep_if_there_is_room
    if _IS_TRIED:
        cache.load_overload = partial(_loaded, cache)
    return function


def _loaded(cache: Any, signature: Any, context: Any) -> Any:
    """What was kept of a function, or None, without filling numba's tables first, which compiling does by itself."""
    rtsys.initialize(context)
    return cache._load_overload(signature, context)


@cache
def stamp_of_sources(root: Path) -> str:
    """Hash of all files below a folder that have compiled functions; these use no constants of other files."""
    sources = [path.read_bytes() for path in sorted(root.rglob("*.py"))]
    return hashlib.sha256(b"".join(source for source in sources if b"@compiled" in source)).hexdigest()


def on_compiling(tell: Callable[[], object]) -> AbstractContextManager[None]:
    """Call ``tell`` whenever a loop is about to be compiled."""
    return event.install_listener("numba:compile", _Begun(tell))


class _Begun(event.Listener):
    def __init__(self, tell: Callable[[], object]) -> None:
        self._tell = tell

    def on_start(self, event: event.Event) -> None:
        self._tell()

    def on_end(self, event: event.Event) -> None:
        pass
