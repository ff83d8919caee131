"""What a page wrote, told in the page itself, so that the next page of its kind can clear away what it leaves behind.

A file goes only where the older page names it and it still is, byte for byte, what was written then: files that
somebody else put there or has changed since stay.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from hashlib import sha256
from pathlib import Path
from typing import Any

_MANIFEST = re.compile(r"<!-- tendonrod-page (\{.*\}) -->\s*\Z")


def manifest(kind: str, files: Iterable[Path]) -> str:
    """The comment that ends a page of a ``kind``: names and SHA-256 of the ``files`` that belong to it."""
    known = {file.name: _digest(file) for file in sorted(files)}
    text = json.dumps({"kind": kind, "files": known}).replace("}}", "} }")  # two would look like a template's trace
    return f"\n<!-- tendonrod-page {text} -->\n"


def left_behind(page: Path, kind: str, kept: Iterable[str]) -> list[Path]:
    """Unchanged files beside an older ``page`` of that ``kind`` that belong to it and are not among ``kept`` names."""
    found = _read(page)
    known = found.get("files")
    if found.get("kind") != kind or not isinstance(known, dict):
        return []
    names = set(known) - set(kept) - {page.name}
    beside = [(page.with_name(name), known[name]) for name in sorted(names) if name and Path(name).name == name]
    return [file for file, digest in beside if _is_plain(file) and _digest(file) == digest]


def _read(page: Path) -> dict[str, Any]:
    """What the older page says; nothing where there is none, or one by another hand."""
    if not _is_plain(page):
        return {}
    known = _MANIFEST.search(page.read_text(encoding="utf-8", errors="replace")[-100_000:])
    try:
        found = json.loads(known[1]) if known else {}
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def _is_plain(file: Path) -> bool:
    return file.is_file() and not file.is_symlink()


def _digest(file: Path) -> str:
    return sha256(file.read_bytes()).hexdigest()
