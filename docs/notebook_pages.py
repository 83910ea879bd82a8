"""Show Jupyter notebooks on the site: run them when it is built, and turn them into pages.

A notebook is kept without its outputs, so that what the site shows is what the present code gives, and a changed
picture is not a change of the file. Markdown cells are read as MyST. A code cell shows its source, then what it
printed, the value of its last expression and the figures that it left open. A cell that fails stops the build.
"""

import ast
import base64
import contextlib
import io
import json
import os
import tempfile
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from docutils import nodes
from myst_parser.parsers.sphinx_ import MystParser
from sphinx.application import Sphinx
from threadpoolctl import threadpool_limits


class NotebookParser(MystParser):
    """Reads a notebook as the MyST page that it is once it has run."""

    supported = ("notebook",)

    def parse(self, inputstring: str, document: nodes.document) -> None:
        """Run the notebook and parse the page."""
        name = Path(document["source"]).name
        super().parse(page_of(json.loads(inputstring), name), document)


def page_of(notebook: dict[str, Any], name: str) -> str:
    """Run a notebook's code cells in order in one namespace and an empty folder; return it as MyST text."""
    namespace: dict[str, Any] = {"__name__": "__main__"}
    parts = []
    # One thread, because those of a busy machine wait for each other: many times as slow on small matrices.
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), threadpool_limits(1):
        for number, cell in enumerate(notebook["cells"]):
            source = "".join(cell["source"])
            if cell["cell_type"] == "code":
                source = f"```python\n{source}\n```\n\n{_run(source, namespace, f'{name}, cell {number}')}"
            parts.append(source)
    return "\n\n".join(parts) + f"\n\n*This page is a notebook: [`{name}`](path:{name}).*\n"


def _run(source: str, namespace: dict[str, Any], where: str) -> str:
    """Run a cell; return what it shows as MyST."""
    tree = ast.parse(source, where)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    printed = io.StringIO()
    value = None
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, where, "exec"), namespace)  # noqa: S102  # our own notebooks
        if last is not None:
            value = eval(compile(ast.Expression(last.value), where, "eval"), namespace)  # noqa: S307
            if source.rstrip().endswith(";"):  # as in Jupyter
                value = None
    text = printed.getvalue() + ("" if value is None else repr(value))
    shown = [f"```text\n{text.rstrip()}\n```"] if text.strip() else []
    return "\n\n".join([*shown, *map(_picture, plt.get_fignums())])


def _picture(number: int) -> str:
    """Return an open figure as an inline image, and close it."""
    figure = plt.figure(number)
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=110, bbox_inches="tight")
    alt = figure.get_label() or "figure"
    plt.close(figure)
    data = base64.b64encode(file.getvalue()).decode()
    return f'```{{raw}} html\n<p><img alt="{alt}" src="data:image/png;base64,{data}"></p>\n```'


def setup(app: Sphinx) -> dict[str, bool]:
    """Let Sphinx read notebooks."""
    os.environ.setdefault("MPLBACKEND", "agg")
    app.add_source_suffix(".ipynb", "notebook")
    app.add_source_parser(NotebookParser)
    return {"parallel_read_safe": False, "parallel_write_safe": True}
