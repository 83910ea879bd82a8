"""Environments of their own for peers that are installed from the package index."""

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

BUILD = Path(__file__).parent / "build"


def own_python(name: str, requirements: Sequence[str]) -> Path | None:
    """Return the interpreter of an environment that holds `requirements`, made on the first call; None without them."""
    folder = BUILD / name
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    complete, pinned = folder / "requirements.txt", "\n".join(requirements)
    if python.exists() and complete.exists() and complete.read_text() == pinned:
        return python
    shutil.rmtree(folder, ignore_errors=True)
    install = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *requirements]
    try:
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True, capture_output=True)
        subprocess.run(install, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    complete.write_text(pinned)
    return python
