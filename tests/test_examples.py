"""Every example computes, asserts its physical number and draws, from any working directory."""

import ast
import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parent.parent / "examples").glob("*.py"))
each_example = pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)


def test_examples_are_numbered():
    assert len(EXAMPLES) >= 5
    assert [int(path.name[:2]) for path in EXAMPLES] == list(range(1, len(EXAMPLES) + 1))


@each_example
def test_example_computes_prints_and_draws(path, monkeypatch, tmp_path, capsys):
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    shown = []
    monkeypatch.setattr(plt, "show", lambda: shown.append(plt.gcf()))
    monkeypatch.chdir(tmp_path)
    try:
        runpy.run_path(str(path), run_name="__main__")
        assert re.search(r": .*\d", capsys.readouterr().out)  # its number, in words
        assert len(shown) == 1
        shown[0].canvas.draw()
        assert all(axes.has_data() for axes in shown[0].axes)
    finally:
        plt.close("all")
    assert not list(tmp_path.iterdir())


@each_example
def test_example_only_prints_and_draws_when_run_as_a_script(path):
    """Computing must not import matplotlib: an example is also what a program without a screen starts from."""
    code = f"import runpy, sys; runpy.run_path({str(path)!r}); sys.exit('matplotlib' in sys.modules)"
    if path is EXAMPLES[0]:  # one process; the others are read
        run = subprocess.run([sys.executable, "-c", code], env={**os.environ, "MPLBACKEND": "Agg"}, timeout=120)
        assert run.returncode == 0
    tree = ast.parse(path.read_text(encoding="utf-8"))
    imported = {alias.name for node in tree.body if isinstance(node, ast.Import) for alias in node.names}
    imported |= {node.module for node in tree.body if isinstance(node, ast.ImportFrom)}
    assert not any(name.startswith("matplotlib") for name in imported)


@each_example
def test_example_says_what_it_does_and_asserts_it(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    assert ast.get_docstring(tree)
    assert any(isinstance(node, ast.Assert) for node in tree.body)
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 60
    assert ast.unparse(tree.body[-1]).startswith("if __name__ == '__main__':")
    assert ast.unparse(tree.body[-1]).endswith("    show()")


@each_example
def test_example_fits_the_page_of_the_tutorial(path):
    assert max(map(len, path.read_text(encoding="utf-8").splitlines())) <= 88
