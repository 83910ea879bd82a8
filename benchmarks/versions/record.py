"""Play all cases with the version at hand and write down what came of them.

Started by `bits` in a process for each version: ``python -m benchmarks.versions.record OUT OWN OLD KEPT [WORDS]``. OUT
receives an archive of arrays for each case and ``cases.json``, which says in which one a case's are, or why it failed;
the other folders are those of `Folders`.
"""

import json
import sys
import time
import warnings
from pathlib import Path

import numpy as np

from benchmarks.versions.cases import all_cases
from benchmarks.versions.cases.case import Case, Folders
from benchmarks.versions.trees import check_source

INDEX = "cases.json"


def record(out: Path, folders: Folders, words: str = "") -> None:
    """Play the cases whose names hold `words`."""
    warnings.simplefilter("ignore")
    index: dict[str, dict[str, str | float]] = {}
    for place, case in enumerate(all_cases()):
        if _is_asked_for(case.name, words):
            if case.name in index:
                raise RuntimeError(f"two cases are called {case.name!r}")
            before = time.perf_counter()
            index[case.name] = _played(case, folders, out, f"{place:04}.npz")
            index[case.name]["seconds"] = round(time.perf_counter() - before, 3)
    (out / INDEX).write_text(json.dumps(index, indent=1))


def _is_asked_for(name: str, words: str) -> bool:
    """Return whether a case is one of those, or writes the file that one of those reads."""
    names = name, name.replace("saved:", "handed over:")
    return any(words.lower() in one.lower() for one in names)


def _played(case: Case, folders: Folders, out: Path, name: str) -> dict[str, str | float]:
    try:
        arrays = case.record(folders)
    except Exception as error:  # noqa: BLE001  # whatever it is: the other cases say more
        return {"error": f"{type(error).__name__}: {error}"}
    np.savez_compressed(out / name, **arrays)  # type: ignore[arg-type]  # its stub takes allow_pickle by name
    return {"archive": name}


if __name__ == "__main__":
    check_source()
    out, own, old, kept, *rest = sys.argv[1:]
    record(Path(out), Folders(Path(own), Path(old), Path(kept)), *rest)
