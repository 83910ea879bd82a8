"""Whether the programs of two versions leave the same results: the paper's study in small, and a comparison."""

import json
import subprocess
from pathlib import Path

import polars as pl

from benchmarks.versions.trees import Tree, command, environment

REPRODUCE = ("reproduce", "--quick", "--workers", "2")
COMPARE = ("compare", "q-learning", "tq-learning")
ENVIRONMENT = "FrozenLake-v1"
SIZE = ("--runs", "3", "--episodes", "50", "--workers", "2")


def compare_studies(old: Tree, new: Tree, folder: Path) -> bool:
    """Run both programs of both versions, print a line for each result and return whether all are equal."""
    folders = [folder / tree.name for tree in (old, new)]
    for tree, out in zip((old, new), folders, strict=True):
        _run(tree, out, *REPRODUCE, "--out", out / "reproduce")
        arguments = [*SIZE, "--out", out / "compare"]
        # The environment is an argument or an option, depending on the version.
        if not _run(tree, out, *COMPARE, ENVIRONMENT, *arguments, may_fail=True):
            _run(tree, out, *COMPARE, "--env", ENVIRONMENT, *arguments)
    equal = True
    for path in sorted(folders[0].rglob("*")):
        if path.name in ("runs.parquet", "weights.parquet", "paths.parquet", "claims.json"):
            place = path.relative_to(folders[0])
            told = _difference(path, folders[1] / place)
            equal &= told is None
            print(f"study, {place}: {told or 'equal'}")
    return equal


def _run(tree: Tree, out: Path, *arguments: object, may_fail: bool = False) -> bool:
    out.mkdir(parents=True, exist_ok=True)
    done = subprocess.run(
        command("tuckerl", *arguments), env=environment(tree), cwd=out, capture_output=True, text=True
    )
    if done.returncode and not may_fail:
        raise RuntimeError(f"tuckerl {' '.join(map(str, arguments))} failed in the {tree.name} version: {done.stderr}")
    return done.returncode == 0


def _difference(old: Path, new: Path) -> str | None:
    if not new.exists():
        return "DIFFERS: it is in the old version only"
    if old.suffix == ".json":
        same = json.loads(old.read_bytes()) == json.loads(new.read_bytes())
    elif old.name == "runs.parquet":
        same = old.read_bytes() == new.read_bytes()
    else:
        same = pl.read_parquet(old).equals(pl.read_parquet(new))
    return None if same else "DIFFERS"
