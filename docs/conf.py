"""How Sphinx builds the documentation site."""

import sys
from pathlib import Path

from tuckerl import __version__

sys.path.insert(0, str(Path(__file__).parent))  # for the reader of notebooks beside this file

project = "tuckerl"
copyright = "2026, the tuckerl developers"  # noqa: A001  # Sphinx's own name
release = version = __version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax", "notebook_pages"]
exclude_patterns = ["_build"]
html_theme = "pydata_sphinx_theme"
html_title = "tuckerl"
html_theme_options = {"secondary_sidebar_items": ["page-toc"], "show_prev_next": True, "navigation_with_keys": False}
autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3
