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
html_theme_options = {
    "header_links_before_dropdown": 8,
    "navigation_with_keys": False,
    "secondary_sidebar_items": ["page-toc"],
}
html_static_path = ["_static"]
html_css_files = ["site.css"]
# Only these have pages below them to navigate.
html_sidebars = {"*": [], **{f"{part}/*": ["sidebar-nav-bs"] for part in ("algorithms", "environments", "notebooks")}}
autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3
