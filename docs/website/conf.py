"""Settings of Sphinx for the site; ``make_site.py`` copies them into the staged tree."""

from pathlib import Path
from typing import Any

from pygments.lexers.special import TextLexer

import mechdae

project = "mechdae"
author = "The mechdae developers"
copyright = author
version = release = mechdae.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax"]
html_theme = "furo"
html_title = f"mechdae {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = [("site.js", {"defer": "defer"})]
html_search_scorer = str(Path(__file__).with_name("scorer.js"))
html_show_sourcelink = False
html_copy_source = False
html_last_updated_fmt = None
templates_path: list[str] = []
exclude_patterns = ["_live"]
html_extra_path = ["_live"]

myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]
# attributes of several classes have the same name: a type that is called like one is no link
suppress_warnings = ["ref.python"]
nitpicky = False

napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
napoleon_preprocess_types = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True


def setup(app: Any) -> None:
    """Show tables of numbers as plain text."""
    app.add_lexer("csv", TextLexer)
