"""The source trees of two versions, and processes that run with one of them."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
"""The present tree."""


class Tree(NamedTuple):
    """One version's sources."""

    name: str  # "old" or "new"
    folder: Path
    commit: str


def both(old: str) -> tuple[Tree, Tree]:
    """Return the tree of the commit `old`, checked out beside the present one, and the present one."""
    commit = _git("rev-parse", "--verify", f"{old}^{{commit}}")
    folder = Path(tempfile.gettempdir()) / "tuckerl-versions" / commit[:12] / "tree"
    if not (folder / "src").exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
        _git("worktree", "add", "--quiet", "--force", "--detach", str(folder), commit)
    state = _git("-C", str(folder), "rev-parse", "HEAD"), _git("-C", str(folder), "status", "--porcelain")
    if state != (commit, ""):
        sys.exit(f"{folder} is no clean checkout of {commit[:12]}: git worktree remove --force {folder}")
    return Tree("old", folder, commit), Tree("new", ROOT, "present tree")


def _git(*arguments: str) -> str:
    done = subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stderr.strip())
    return done.stdout.strip()


def command(module: str, *arguments: object) -> list[str]:
    """Return the command that runs a module in this interpreter, whatever lies in the folder that it runs in."""
    return [sys.executable, "-P", "-m", module, *map(str, arguments)]


def environment(tree: Tree, cache: Path | None = None) -> dict[str, str]:
    """Return the variables under which Python finds this version of `tuckerl`, and this package.

    Compiled kernels are kept beside each version's own sources, or in the folder `cache`.
    """
    variables = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    variables["PYTHONPATH"] = os.pathsep.join([str(tree.folder / "src"), str(ROOT)])
    return variables if cache is None else variables | {"NUMBA_CACHE_DIR": str(cache)}


def check_source() -> None:
    """Leave with an error if `tuckerl` is not the version that `environment` asked for."""
    import tuckerl

    source = Path(tuckerl.__file__).parents[1]
    if source != Path(os.environ["PYTHONPATH"].split(os.pathsep)[0]):
        sys.exit(f"tuckerl was imported from {source}")
