"""How Sphinx builds the documentation site."""

import sys
from pathlib import Path

from sphinx.application import Sphinx

from tuckerl import __version__

sys.path.insert(0, str(Path(__file__).parent))  # for the extensions beside this file

project = "tuckerl"
copyright = "2026, the tuckerl developers"  # noqa: A001  # Sphinx's own name
release = version = __version__
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "notebook_pages",
    "mathml",
    "picture_links",
]
exclude_patterns = ["_build"]
html_theme = "pydata_sphinx_theme"
html_title = f"tuckerl {version}"
html_favicon = "_static/favicon.svg"
html_context = {"default_mode": "auto"}
html_theme_options = {
    "logo": {"text": f"tuckerl {version}"},
    "header_links_before_dropdown": 5,
    "navbar_align": "left",
    "navigation_with_keys": False,
    "secondary_sidebar_items": ["page-toc"],
    "show_toc_level": 2,
    "collapse_navigation": True,  # its arrows would have no name for those who hear a page
}
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_sidebars = {"index": [], "**": ["sidebar-nav-bs"]}
autodoc_typehints = "none"
autodoc_member_order = "bysource"
maximum_signature_line_length = 68  # a longer one has a line for each parameter
toc_object_entries_show_parents = "hide"
napoleon_google_docstring = False
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3


def keep_properties_whole(app: Sphinx, what: str, name: str, _: object, options: object, lines: list[str]) -> None:
    """Stop Napoleon from taking what stands before a colon in a property's first line for its type."""
    if what in ("attribute", "property", "data") and lines:
        lines.insert(0, "\\ ")  # Napoleon looks at the first line only; this one shows as nothing


def setup(app: Sphinx) -> None:
    """Go over docstrings before Napoleon does."""
    app.connect("autodoc-process-docstring", keep_properties_whole, priority=400)
