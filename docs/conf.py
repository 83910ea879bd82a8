"""How Sphinx builds the documentation site."""

from tuckerl import __version__

project = "tuckerl"
copyright = "2026, the tuckerl developers"  # noqa: A001  # Sphinx's own name
release = version = __version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax"]
exclude_patterns = ["_build"]
html_theme = "pydata_sphinx_theme"
html_title = "tuckerl"
autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
myst_heading_anchors = 3
suppress_warnings = ["myst.xref_missing", "ref.python"]  # the README's links lead into the repository
