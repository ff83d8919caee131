"""Sphinx extension: ``.. problem-table:: elastica`` is that table of docs/problems, computed at build time."""

from docutils import nodes
from docutils.parsers.rst import Directive
from docutils.statemachine import StringList
from problems import table
from sphinx.application import Sphinx


class ProblemTable(Directive):
    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        lines = [".. list-table::", "   :header-rows: 1", "   :class: numbers", ""]
        for cells in table(self.arguments[0]).cells:
            lines += [f"   {'* -' if i == 0 else '  -'} {cell}" for i, cell in enumerate(cells)]
        container = nodes.Element()
        self.state.nested_parse(StringList(lines, self.block_text), self.content_offset, container)
        return container.children


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("problem-table", ProblemTable)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
