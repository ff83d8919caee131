"""How the kernels are compiled: `jit`, with a cache on disk that watches every kernel file.

Numba's own cache watches only the file in which a function stands; a function that calls one of another file would go
on running old code after a change there. Here the freshness of every function is that of all files named kernel*.py.
"""

from pathlib import Path
from typing import Any

from numba import njit

_FILES = sorted(Path(__file__).parent.glob("kernel*.py"))
_STAMP = tuple((file.name, file.stat().st_mtime_ns, file.stat().st_size) for file in _FILES)


def jit(function) -> Any:
    """``function`` compiled by Numba, without Python's lock and with the cache on disk.

    ``_nrt`` off: no allocation, which then does not even compile, and no counting of references to the arrays that
    compiled functions hand each other, which took 40 % of a solve. Such a function must not return an array to Python.
    """
    options = {"error_model": "numpy", "fastmath": {"contract", "nsz", "arcp"}, "nogil": True, "_nrt": False}
    compiled: Any = njit(cache=True, **options)(function)
    compiled._cache._impl._locator.get_source_stamp = lambda: _STAMP
    return compiled
