"""Sphinx configuration. The build is offline and treats warnings as errors (`make docs`)."""

import re
import sys
from importlib.metadata import version as installed_version
from pathlib import Path

from matplotlib.sphinxext.plot_directive import TEMPLATE

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_ext"), str(HERE)]  # docs/_ext, and docs for the package `problems`

project = "tendonrod"
author = "tendonrod developers"
copyright = "2026, tendonrod developers"
release = installed_version("tendonrod")

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.viewcode",
    "matplotlib.sphinxext.plot_directive",
    "commandhelp",
    "problemtables",
    "svgmath",
]
default_role = "code"
html_math_renderer = "svg"
math_number_all = True
math_eqref_format = "({number})"
numfig = True

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88
MADE_BY_FUNCTIONS = (
    "Motion", "Plan", "Projection", "Section", "Shape", "Limit", "Status", "Stability", "Contacts", "Jacobian", "Batch",
    "Branch", "Critical", "Fold", "Bifurcation", "BalanceErrors", "Worst",
)  # fmt: skip

plot_working_directory = str(HERE.parent)
plot_pre_code = "__file__ = 'examples/of-this-page.py'"  # examples find the files that lie beside them
plot_formats = [("svg", 100)]
plot_html_show_formats = False
plot_template = TEMPLATE.partition(".. only:: not html")[0]  # the second copy would be counted as a figure too
plot_html_show_source_link = False

exclude_patterns = ["_build"]
html_theme = "furo"
html_title = f"tendonrod {release}"
html_static_path = ["_static"]
html_css_files = ["math.css"]
html_copy_source = False


def escape_bars(_app, _what, _name, _obj, _options, lines):
    """Docstrings write |x| for a magnitude; outside code that would be a substitution of reStructuredText."""
    lines[:] = [re.sub(r"(`+[^`]*`+)|\|", lambda found: found[1] or r"\|", line) for line in lines]


def plain_signature(_app, _what, name, _obj, _options, signature, returns):
    """No constructor where a function makes the object; defaults as a caller would write them."""
    if name.rpartition(".")[2] in MADE_BY_FUNCTIONS:
        return "", None
    for written, meant in (("<factory>", "{}"), ("ZERO", "(0.0, 0.0, 0.0)")):
        signature = signature and signature.replace(written, meant)
    return signature, returns


def setup(app):
    app.connect("autodoc-process-docstring", escape_bars)
    app.connect("autodoc-process-signature", plain_signature)
