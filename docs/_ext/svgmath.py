"""Sphinx extension: LaTeX math as inline SVG, drawn by ziamath at build time.

The pages then need neither network, JavaScript, a LaTeX installation nor a math font in the browser, look the same
everywhere, and follow the theme's text colour (light and dark). The source stays readable to a screen reader.
"""

import re
from html import escape

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.math import get_node_equation_number
from sphinx.writers.html5 import HTML5Translator
from ziamath.config import config
from ziamath.tex import tex2mml
from ziamath.zmath import Math

FONT_SIZE = 16.0
EM = FONT_SIZE / 1.06  # a little larger than the text: the math font looks small beside a sans-serif
config.svg2 = False  # glyphs as plain paths: no element ids that would clash between formulas
config.math.color = "currentColor"
# A minus that opens a group or follows a relation, a comma or a bracket is a sign: no space after it.
SIGN = re.compile(r"(<mrow>|<mtd[^>]*>|<mo[^>]*>&#x0(?:003D|002C|0028|2248);</mo>)<mo>(?=&#x02212;)")
PATH = re.compile(r'(?:<path d="([^"]*)"|<rect x="([^"]*)" y="[^"]*" width="([^"]*)")')
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")


def ink_extent(svg: str) -> tuple[float, float]:
    """Leftmost and rightmost coordinate that is drawn; ziamath's own box leaves room beside accents."""
    edges: list[float] = []
    for path, left, width in PATH.findall(svg):
        edges += [float(x) for x in NUMBER.findall(path)[0::2]] if path else [float(left), float(left) + float(width)]
    return min(edges), max(edges)


def latex_to_svg(latex: str, inline: bool) -> str:
    """One SVG element whose size and baseline are in em, so that it scales with the text around it."""
    mathml = SIGN.sub(r'\1<mo form="prefix">', tex2mml(latex, inline=inline))
    svg = Math(mathml, size=FONT_SIZE).svg()
    box = re.search(r'viewBox="(\S+) (\S+) (\S+) (\S+)"', svg)
    assert box is not None
    _, top, _, height = (float(x) for x in box.groups())
    left, right = ink_extent(svg)
    width = right - left
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" class="math" role="img" aria-label="{escape(latex)}" '
        f'viewBox="{left:.3f} {top:.3f} {width:.3f} {height:.3f}" '
        f'style="width:{width / EM:.3f}em;height:{height / EM:.3f}em;'
        f'vertical-align:{-(height + top) / EM:.3f}em">'
    )
    return head + svg[svg.index(">") + 1 :]


def visit_math(self: HTML5Translator, node: nodes.math) -> None:
    self.body.append(latex_to_svg(node.astext(), inline=True))
    raise nodes.SkipNode


def visit_displaymath(self: HTML5Translator, node: nodes.math_block) -> None:
    self.body.append(self.starttag(node, "div", CLASS="equation"))
    number = get_node_equation_number(self, node)
    if number:
        self.body.append(f'<span class="eqno">({number})')
        self.add_permalink_ref(node, "Link to this equation")
        self.body.append("</span>")
    self.body.append(latex_to_svg(node.astext(), inline=False) + "</div>\n")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_html_math_renderer("svg", (visit_math, None), (visit_displaymath, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
