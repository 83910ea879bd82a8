"""Differences that an earlier report worked out: of very many comparisons, only those with new runs take time again."""

import hashlib
import json
import math
from importlib.metadata import version
from pathlib import Path
from typing import Any

from tuckerl import intervals
from tuckerl.files import write_whole
from tuckerl.studies import statistics
from tuckerl.studies.statistics import Difference, seeded_difference
from tuckerl.types import FloatArray

FILE = "differences.json"


class Remembered:
    """Works out paired differences, and keeps them in a folder, each by a digest of all that decides it.

    What stands in the file is believed only if the digest of the whole is right.

    Parameters
    ----------
    folder : Path
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / FILE
        self._known = _read(self._path)
        self._used: dict[str, list[float | None]] = {}
        self._code = _code()

    def __call__(
        self,
        samples: tuple[FloatArray, FloatArray],
        sign: float,
        n_diverged: int,
        entropy: list[int],
        *,
        relative: bool,
    ) -> Difference:
        """Return what `seeded_difference` returns."""
        key = hashlib.sha256(f"{self._code} {sign} {entropy} {relative} ".encode())
        for sample in samples:
            key.update(sample.tobytes())
        name = key.hexdigest()[:32]
        numbers = self._used.get(name) or self._known.get(name)
        if numbers is None:
            made = seeded_difference(samples, sign, n_diverged, entropy, relative=relative)
            numbers = [None if math.isnan(number) else float(number) for number in made[:3]]
        self._used[name] = numbers
        mean, low, high = (math.nan if number is None else number for number in numbers)
        return Difference(mean, low, high, samples[0].size, n_diverged, relative)

    def write(self) -> None:
        """Keep what was asked for since this was made, and nothing else.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        if self._used != self._known:
            content = json.dumps({"digest": _digest(self._used), "differences": self._used}, indent=0)
            write_whole(self._path, content.encode())


def _read(path: Path) -> dict[str, list[float | None]]:
    try:
        held: dict[str, Any] = json.loads(path.read_bytes())
        known: dict[str, list[float | None]] = held["differences"]
        return known if _digest(known) == held["digest"] else {}
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return {}  # what is not there, or damaged, is worked out


def _digest(differences: dict[str, list[float | None]]) -> str:
    return hashlib.sha256(json.dumps(differences, sort_keys=True).encode()).hexdigest()


def _code() -> str:
    """Return what tells the code that works differences out from any other."""
    sources = hashlib.sha256()
    for module in (intervals, statistics):
        sources.update(Path(str(module.__file__)).read_bytes())
    return " ".join([sources.hexdigest(), *(version(library) for library in ("numpy", "scipy"))])
