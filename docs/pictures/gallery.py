"""Draw the pictures of docs/gallery.md by its own lines: ``python -m docs.pictures.gallery`` writes them."""

import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent / "gallery"
PAGE = Path(__file__).parents[1] / "gallery.md"


def main() -> None:
    """Run the page's blocks in an empty folder, and keep the pictures that it shows."""
    page = PAGE.read_text("utf-8")
    namespace: dict[str, Any] = {}
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            for code in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
                exec(code, namespace)  # noqa: S102  # our own page
            for command in re.findall(r"^\$ tuckerl (.*)$", page, re.MULTILINE):
                subprocess.run([sys.executable, "-m", "tuckerl", *shlex.split(command)], check=True)  # noqa: S603
            made = {picture.name: picture for picture in Path(folder).rglob("*.png")}
            HERE.mkdir(exist_ok=True)
            for name in re.findall(r"\(pictures/gallery/([^)]+)\)", page):
                shutil.copyfile(made[name], HERE / name)
        finally:
            os.chdir(before)


if __name__ == "__main__":
    main()
