"""`load_phantom`: the two parametric phantoms by name, or a file."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from os import PathLike, fspath
from os.path import abspath

from ..errors import InvalidInput
from .dimensions import Dimensions
from .levels import DEFAULT, level_range
from .phantom import Phantom

PARAMETRIC = ("printed", "anatomical")


def load_phantom(source: str | PathLike[str] = "printed", *, levels: str | None = None) -> Phantom:
    """A phantom: "printed", "anatomical", or the path of a phantom file.

    levels: range from the head down, instead of T8-L2 or the file's. The first time, distances are computed, which
    takes seconds; they are kept on disk. Raises `InvalidInput` with file, key and what is allowed.
    """
    if isinstance(source, str) and source in PARAMETRIC:
        return _built(source, level_range(levels or DEFAULT))
    allowed = f"one of {', '.join(PARAMETRIC)}, or the path of a phantom file, .toml"
    if not isinstance(source, (str, PathLike)) or not fspath(source).lower().endswith(".toml"):
        raise InvalidInput("phantom", source, allowed)
    from .phantomfile import read_phantom

    return replace(read_phantom(fspath(source), levels), source=abspath(source))


@lru_cache(maxsize=4)
def _built(kind: str, names: tuple[str, ...]) -> Phantom:
    from .building import anatomical_phantom, printed_phantom

    return replace((printed_phantom if kind == "printed" else anatomical_phantom)(names, Dimensions()), source=kind)
