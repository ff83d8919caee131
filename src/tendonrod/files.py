"""Files appear complete or not at all, and are read as text or refused by name."""

from __future__ import annotations

import codecs
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from .errors import Fact, InvalidInput

_UTF16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


@contextmanager
def complete(field: str, path: Path) -> Iterator[Path]:
    """A draft beside ``path``, of the same suffix, to write to; it takes the place of ``path`` once it is complete.

    Where writing fails or is interrupted the draft goes away and an older file at ``path`` stays as it is; a link stays
    a link. Raises `InvalidInput` for ``field`` in place of OSError.
    """
    real = Path(os.path.realpath(path))
    draft = real.with_name(f".{real.stem}.{os.getpid()}{real.suffix}")
    try:
        try:
            yield draft
            os.replace(draft, real)
        finally:
            draft.unlink(missing_ok=True)
    except OSError as error:
        raise InvalidInput(field, str(path), f"writable: {error.strerror or error}") from None


def file_name(field: str, path: object, suffixes: Sequence[str]) -> Path:
    """``path``, text or path-like, if it ends in one of ``suffixes``, in any case; else `InvalidInput`."""
    text = os.fspath(path) if isinstance(path, os.PathLike) else path
    if not isinstance(text, str) or "\0" in text or Path(text).suffix.lower() not in suffixes:
        *others, last = suffixes
        names = f"{', '.join(others)} or {last}" if others else last
        raise InvalidInput(field, text, f"a file name that ends in {names}")
    return Path(text)


def text_of(field: str, name: str, kind: str, encoding: str | None = None, hint: str = "") -> str:
    """The text of the file ``name``, a ``kind`` such as "CSV". Raises `InvalidInput` where it cannot be read.

    encoding: None for UTF-16 where the file begins with its mark, else UTF-8. hint: what to do about a file that is
    written in another.
    """
    try:
        content = Path(name).read_bytes()
        return content.decode(encoding or ("utf-16" if content[:2] in _UTF16 else "utf-8-sig"))
    except UnicodeError as error:
        at = f"; byte {error.start} is not" if isinstance(error, UnicodeDecodeError) else ""
        raise InvalidInput(field, Fact(name), f"{(encoding or 'UTF-8')} text{at}{hint}") from None
    except (FileNotFoundError, ValueError):
        raise InvalidInput(field, Fact(name or "''"), f"an existing {kind} file") from None
    except OSError as error:
        raise InvalidInput(field, Fact(name), f"a readable file: {error.strerror}") from None


def with_comments_apart(text: str) -> tuple[list[str], str]:
    """The lines that begin with # above the first that holds anything else, and the text with them made empty."""
    lines = text.splitlines(keepends=True)
    above = next((k for k, line in enumerate(lines) if line.strip() and not line.startswith("#")), len(lines))
    return [line for line in lines[:above] if line.strip()], "\n" * above + "".join(lines[above:])
