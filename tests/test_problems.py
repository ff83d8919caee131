"""The problem sets of docs/problems.rst: every number of its tables is as near to its reference as the page says."""

import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[1] / "docs"
sys.path.insert(0, str(DOCS))
import problems  # noqa: E402  # pyright: ignore[reportMissingImports]

NAMES = tuple(problems.problems())


@pytest.mark.parametrize("name", NAMES)
def test_differences_are_within_what_the_page_says(name):
    table = problems.table(name)
    for row in table.rows:
        assert abs(table.difference(row)) <= table.within, row
    assert len({len(cells) for cells in table.cells}) == 1


def test_every_problem_has_its_table_and_its_figure_on_the_page():
    page = (DOCS / "problems.rst").read_text(encoding="utf-8")
    for name in NAMES:
        assert f".. problem-table:: {name}\n" in page
        assert f'problems.draw("{name}")\n' in page


@pytest.mark.parametrize("name", NAMES)
def test_figures_show_something(name):
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    try:
        problems.draw(name)
        assert all(axes.has_data() for axes in plt.gcf().axes)
    finally:
        plt.close("all")
