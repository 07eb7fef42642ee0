"""How Sphinx makes the site of the pages that build.py has put together."""

import tomllib
from pathlib import Path

HERE = Path(__file__).parent
_project = tomllib.loads((HERE.parents[1]/"pyproject.toml").read_text(encoding="utf-8"))["project"]

project = "EMCON"
author = "the EMCON developers"
version = release = _project["version"]
extensions = ["myst_parser", "sphinx.ext.mathjax"]
myst_enable_extensions = ["dollarmath", "colon_fence"]
# `$h$0.1` is no formula, `$h$-axis` is one.
myst_dmath_allow_digits = False
myst_heading_anchors = 4
# Equations have the numbers that they have in the text.
math_number_all = False
# From the site itself: it can be read without a network.
mathjax_path = "tex-svg.js"
html_theme = "furo"
html_title = f"EMCON {version}"
html_static_path = [str(HERE.parents[1]/"build/site/pages/_static")]
html_css_files = ["site.css"]
html_copy_source = False
html_show_copyright = False
pygments_style = "friendly"
add_module_names = False
maximum_signature_line_length = 80
