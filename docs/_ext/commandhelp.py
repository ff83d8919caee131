"""Sphinx extension: ``.. command-help:: shape`` is what ``tendonrod shape --help`` prints, asked at build time.

Of a command below another one both are given: ``.. command-help:: rig ftl``.
"""

import os
import subprocess
import sys

from docutils import nodes
from docutils.parsers.rst import Directive
from sphinx.application import Sphinx


class CommandHelp(Directive):
    optional_arguments = 2

    def run(self) -> list[nodes.Node]:
        command = [sys.executable, "-m", "tendonrod", *self.arguments, "--help"]
        environment = {**os.environ, "COLUMNS": "80", "TERMINAL_WIDTH": "80", "NO_COLOR": "1"}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise self.error(f"{' '.join(command)}: exit status {done.returncode}: {done.stderr}")
        block = nodes.literal_block(done.stdout, done.stdout.rstrip())
        block["language"] = "text"
        return [block]


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("command-help", CommandHelp)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
