"""Files of learners that are damaged, or crafted with a right checksum: refused, or a sound learner.

Every case follows from its number, so that a run can go on where another stopped, and a failure can be looked at again:
``python -m tests.training.fuzz_files show NUMBER`` writes its file and says what comes of it. Crafted files are read
and played in a child process, so that a dead interpreter is seen, and one that takes too much memory.
"""

import json
import resource
import select
import subprocess
import sys
import tempfile
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import tuckerl
from tests.learners.worlds import drift
from tests.training import crafted_files as crafted
from tests.training.crafted_files import Parts
from tests.training.make_saved_files import ENVIRONMENTS
from tuckerl.errors import ParameterError, SavedFileError
from tuckerl.training import learner_file

FOLDER = Path(__file__).parent / "saved_files"
FILES = sorted(FOLDER.glob("*.tuckerl"))
SECONDS = 120.0
"""After which a child process is taken to hang."""

ACCEPTED, REFUSED = "accepted", "refused"
Rng = np.random.Generator


class Answer(NamedTuple):
    """What came of a file."""

    outcome: str  # ACCEPTED, REFUSED, or what went wrong
    memory: int  # the child's peak so far in bytes


# Damage


def damaged(number: int) -> bytes:
    """Return a saved file, damaged in one way or several."""
    rng = np.random.default_rng((1, number))
    original = FILES[rng.integers(len(FILES))].read_bytes()
    content = bytearray(original)
    while bytes(content) == original or _is_renumbered(bytes(content), original):
        for _ in range(rng.integers(1, 4)):
            content = _DAMAGES[rng.integers(len(_DAMAGES))](content, rng)
    return bytes(content)


def _is_renumbered(content: bytes, original: bytes) -> bool:
    """Return whether nothing but the version of an older format differs, which these did not sign."""
    return original[:25] != b"tuckerl learner, format 3" and content.partition(b"\n")[2] == original.partition(b"\n")[2]


def _flip(content: bytearray, rng: Rng) -> bytearray:
    for _ in range(rng.integers(1, 9)):
        if content:
            content[rng.integers(len(content))] ^= 1 << rng.integers(8)
    return content


def _cut(content: bytearray, rng: Rng) -> bytearray:
    return content[: rng.integers(len(content) + 1)]


def _insert(content: bytearray, rng: Rng) -> bytearray:
    place = int(rng.integers(len(content) + 1))
    return content[:place] + bytearray(rng.bytes(int(rng.integers(1, 40)))) + content[place:]


def _leave_out(content: bytearray, rng: Rng) -> bytearray:
    start, stop = sorted(rng.integers(len(content) + 1, size=2))
    return content[:start] + content[min(stop, start + 100) :]


def _exchange(content: bytearray, rng: Rng) -> bytearray:
    """Let two parts change places, as members of an archive might."""
    a, b, c = sorted(rng.integers(len(content) + 1, size=3))
    return content[:a] + content[b:c] + content[a:b] + content[c:]


def _renumber(content: bytearray, rng: Rng) -> bytearray:
    """Name another version: the checksum covers that line, too."""
    first, line, rest = content.partition(b"\n")
    return first[:-1] + b"%d" % rng.integers(0, 5) + line + rest


_DAMAGES: tuple[Callable[[bytearray, Rng], bytearray], ...] = (_flip, _cut, _insert, _leave_out, _exchange, _renumber)


# Craft


def crafted_file(number: int) -> tuple[str, bytes]:
    """Return the name of a saved file and what a stranger made of it, with a right checksum."""
    rng = np.random.default_rng((2, number))
    path = FILES[rng.integers(len(FILES))]
    parts = crafted.take_apart(path.read_bytes())
    for _ in range(rng.integers(1, 3)):
        kind = rng.integers(10)
        if kind < 4:
            parts = parts._replace(header=_altered(parts.header, rng))
        elif kind < 9:
            _alter_array(parts.arrays, rng)
        else:
            return path.stem, _altered_structure(parts, rng)
    return path.stem, crafted.put_together(parts)


_VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, 1, -1, 2, 3, 5, 7, 100, 0.5, 1.0, -0.5, 1e-300, 1e300, 2**31, 2**32, 2**53, 2**63, 2**64),
    *(-(2**63), 10**30, -(10**30), 10**400, "", "x", "0", "a/b", "\ud800", [], {}, [[]], [0], [1, 2], [-1], [None]),
    *({"x": 1}, {"schedule": "Linear"}, {"schedule": []}, {"policy": "Greedy"}, {"policy": 3}, {"tuple": 1}),
    *({"float": "nan"}, {"dict": {"a": 1}}, "FrozenLake-v1", "os:Env-v0", "__main__:Learner", "first", "QLearning"),
    *({"schedule": "Linear", "start": 1.0, "stop": 0.0, "episodes": 3}, {"schedule": "Linear", "start": "x"}),
)


def _altered(value: Any, rng: Rng) -> Any:
    """Return JSON that differs in one place."""
    inner = list(value) if isinstance(value, dict) else list(range(len(value))) if isinstance(value, list) else []
    if not inner or rng.random() < 0.02:
        near = isinstance(value, int) and not isinstance(value, bool) and rng.random() < 0.3
        return value + int(rng.integers(-2, 3)) if near else _VALUES[rng.integers(len(_VALUES))]
    copy, key = value.copy(), inner[rng.integers(len(inner))]
    what = rng.random()
    if what < 0.08:
        copy.pop(key)
    elif what < 0.14 and isinstance(copy, dict):
        copy[("alpha", "extra", "seed", "env", "held", "q", "policy")[rng.integers(7)]] = _VALUES[
            rng.integers(len(_VALUES))
        ]
    elif what < 0.18 and isinstance(copy, list):
        copy.append(copy[key])
    else:
        copy[key] = _altered(copy[key], rng)
    return copy


def _alter_array(arrays: dict[str, np.ndarray], rng: Rng) -> None:
    names = sorted(arrays)
    if not names:
        return
    name, other = names[rng.integers(len(names))], names[rng.integers(len(names))]
    what = rng.random()
    if what < 0.5:
        arrays[name] = _other_values(arrays[name].copy(), rng)
    elif what < 0.7:
        arrays[name] = _other_shape(arrays[name], rng)
    elif what < 0.8:
        kinds = ("<i8", "<i4", "<u4", "<f8", "<f4", "|b1", "|u1", "<u8", ">f8", ">i8", "<c16", "<U3", "|S2", "<M8[s]")
        with np.errstate(all="ignore"):
            plain = arrays[name] if arrays[name].dtype.names is None else arrays[name]["reward"]
            try:
                arrays[name] = plain.astype(kinds[rng.integers(len(kinds))])
            except TypeError:
                arrays[name] = plain.astype(np.float32)
    elif what < 0.85:
        del arrays[name]
    elif what < 0.9:
        arrays[f"{name}{('x', '/x', '.x', '0')[rng.integers(4)]}"] = arrays[other]
    else:
        arrays[name], arrays[other] = arrays[other], arrays[name]


def _other_values(array: np.ndarray, rng: Rng) -> np.ndarray:
    if array.dtype.names is not None and array.size:
        field = array.dtype.names[rng.integers(len(array.dtype.names))]
        array[field] = _other_values(array[field].copy(), rng)
        return array
    if not array.size:
        return array
    flat = array.reshape(-1)
    places = rng.integers(flat.size, size=rng.integers(1, 4)) if rng.random() < 0.7 else np.arange(flat.size)
    if array.dtype.kind == "b":
        if rng.random() < 0.2:
            flat.view(np.uint8)[places] = rng.integers(256)  # neither False nor True
        else:
            flat[places] = rng.random() < 0.5
    elif array.dtype.kind in "iu":
        ends = np.iinfo(array.dtype)
        near = int(flat.max())
        chosen = (0, 1, 2, 3, near, near + 1, flat.size, ends.max, ends.min, ends.max - 1, 2**31 - 1, 5, 6, 7, 12)
        flat[places] = np.clip(chosen[rng.integers(len(chosen))], ends.min, ends.max).astype(array.dtype)
        if rng.random() < 0.3:
            rng.shuffle(flat)
    elif array.dtype.kind == "f":
        chosen_floats = (np.nan, np.inf, -np.inf, 0.0, -0.0, 1.0, -1.0, 0.5, 2.0, 1e308, -1e308, 5e-324, 1e-9)
        flat[places] = chosen_floats[rng.integers(len(chosen_floats))]
        if rng.random() < 0.2:
            rng.shuffle(flat)
    return array


def _other_shape(array: np.ndarray, rng: Rng) -> np.ndarray:
    what = rng.integers(7)
    if what == 0:
        return array[np.newaxis]
    if what == 1:
        return array.reshape(-1)
    if what == 2:
        return np.asfortranarray(array.T)
    axis = int(rng.integers(array.ndim)) if array.ndim else 0
    if array.ndim == 0:
        return np.repeat(array, 3)
    if what == 3:
        return np.take(array, range(0), axis=axis)
    if what == 4:
        return np.take(array, range(max(array.shape[axis] - 1, 0)), axis=axis)
    if what == 5:
        return np.concatenate([array, array], axis=axis)
    more = np.zeros((*array.shape[:axis], int(rng.integers(1, 3)), *array.shape[axis + 1 :]), dtype=array.dtype)
    return np.concatenate([array, more], axis=axis)


def _altered_structure(parts: Parts, rng: Rng) -> bytes:
    """Return a file whose text, manifest, archive or members are not what they should be."""
    what = rng.integers(9)
    text = json.dumps(parts.header)
    if what == 0:
        odd = (
            '{"x": 1, "x": 2}',
            "[" * 100_000,
            "NaN",
            "1e999",
            '"',
            "{}",
            "[]",
            "9" * 5000,
            text[:-1],
            text[:-1] + ",",
        )
        return crafted.put_together(parts, odd[rng.integers(len(odd))])
    if what == 1:
        place = int(rng.integers(len(text)))
        return crafted.put_together(parts, text[:place] + ("NaN", "1e999", '[{"')[rng.integers(3)] + text[place + 1 :])
    if what == 2 and parts.version == 3:
        return crafted.put_together(parts, forms=_altered(crafted.manifest_of(parts.arrays), rng))
    members = {f"{name}.npy": crafted.npy(array) for name, array in parts.arrays.items()}
    top = "manifest.json" if parts.version == 3 else "header.npy"
    whole = json.dumps({"header": parts.header, "arrays": crafted.manifest_of(parts.arrays)}).encode()
    members[top] = whole if parts.version == 3 else crafted.npy(np.frombuffer(text.encode(), dtype=np.uint8))
    names = sorted(members)
    name = names[rng.integers(len(names))]
    if what == 3:
        member = bytearray(members[name])
        member[rng.integers(min(len(member), 128))] = rng.integers(256)  # in its description, mostly
        members[name] = bytes(member)
    elif what == 4:
        members[name] = members[name][: rng.integers(len(members[name]))]
    elif what == 5:
        shape = ((2**33,), (-1,), (2**62, 4), (3, -2), (0, 2**62))[rng.integers(5)]
        members[name] = crafted.huge_zeros(shape, ("<f8", "|b1", "|O", "<U0", "|V0")[rng.integers(5)])
    elif what == 6:
        members[("extra", "../x.npy", "extra.npy", "x/.npy")[rng.integers(4)]] = members[name]
    method = (zipfile.ZIP_DEFLATED, zipfile.ZIP_STORED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)[
        rng.integers(4) if what == 7 else 0
    ]
    body = bytearray(crafted.archive_of(members, method))
    if what == 8:
        for _ in range(rng.integers(1, 6)):
            body[rng.integers(len(body))] = rng.integers(256)
    return crafted.sign(parts.version, bytes(body))


# The child process, which reads and plays


def environment_of(name: str) -> Any:
    """Return what `load` must be given for a saved file by its name, None if nothing."""
    version, _, own = name.partition("_")
    if version == "format1":
        return drift() if own == "sarsa_lambda" else None
    make = ENVIRONMENTS.get(own)
    return None if make is None else make()


def play(path: Path, name: str) -> str:
    """Load a file and use the learner that comes of it; return what came of that."""
    env = environment_of(name)
    try:
        learner = tuckerl.load(path, env=env)
    except SavedFileError:
        return REFUSED
    except ParameterError as error:  # says that the file belongs to another environment
        return REFUSED if env is not None and "env must be" in str(error) else f"load: {error!r}"
    limit = learner.problem.max_episode_steps
    slow = learner.parameters.get("planning_steps", 0) > 10_000 or limit is None or limit > 200_000
    step = learner.tensor_step
    if slow or (step is not None and step.max_iterations > 1000):
        return ACCEPTED  # sound, and nobody has so much time
    try:
        learner.learn(2)
        learner.evaluate(2)
        if learner.problem.agents == () and not learner.problem.is_data:
            learner.learn(1)
        elif learner.problem.is_data:
            learner.predict(0, deterministic=False)
        if step is not None:
            learner.learn(5)
        learner.save(path)
    except SavedFileError as error:
        return ACCEPTED if learner.diverged_at is not None else f"play: {error!r}"
    except Exception as error:  # noqa: BLE001  # whatever comes is what is looked for
        return f"play: {error!r}"
    return ACCEPTED


def serve() -> None:
    """Answer for each line of the standard input, a path and a saved file's name."""
    warnings.simplefilter("ignore")
    for line in sys.stdin:
        path, name = line.rstrip("\n").split("\t")
        try:
            outcome = play(Path(path), name)
        except BaseException as error:  # noqa: BLE001  # it is the parent that judges
            outcome = f"load: {error!r}"
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        print(json.dumps([outcome[:500], peak]), flush=True)  # noqa: T201  # the answer


class Child:
    """A process that reads and plays files, one after the other; a new one after it has died."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self._process: subprocess.Popen[str] | None = None

    def __enter__(self) -> "Child":
        return self

    def __exit__(self, *_: object) -> None:
        self._end()
        self._folder.cleanup()

    def ask(self, name: str, content: bytes) -> Answer:
        """Return what comes of a file."""
        path = Path(self._folder.name) / "agent.tuckerl"
        path.write_bytes(content)
        if self._process is None:
            command = [sys.executable, "-m", "tests.training.fuzz_files", "serve"]
            self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(f"{path}\t{name}\n")
        process.stdin.flush()
        ready, _, _ = select.select([process.stdout], [], [], SECONDS)
        line = process.stdout.readline() if ready else ""
        if line:
            return Answer(*json.loads(line))
        self._end()
        return Answer(f"the interpreter died ({process.returncode})" if ready else "it hangs", 0)

    def _end(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            for pipe in (self._process.stdin, self._process.stdout):
                assert pipe is not None
                pipe.close()
            self._process = None


class Figures(NamedTuple):
    """What came of many files."""

    accepted: int
    refused: int
    failures: dict[int, str]  # by number
    memory: int  # the largest growth of a child's memory in bytes


def try_crafted(first: int, count: int, patience: int = 10) -> Figures:
    """Read and play crafted files by their numbers; stop after `patience` failures."""
    outcomes: dict[str, int] = {ACCEPTED: 0, REFUSED: 0}
    failures: dict[int, str] = {}
    growth, base = 0, 0
    with Child() as child:
        for path in FILES:  # so that all kernels are there
            answer = child.ask(path.stem, path.read_bytes())
            assert answer.outcome == ACCEPTED, (path.stem, answer)
            base = answer.memory
        for number in range(first, first + count):
            name, content = crafted_file(number)
            answer = child.ask(name, content)
            if answer.outcome in outcomes:
                outcomes[answer.outcome] += 1
                growth = max(growth, answer.memory - base)
            else:
                failures[number] = f"{name}: {answer.outcome}"
                base = 0 if answer.memory == 0 else base
                if len(failures) >= patience:
                    break
            base = base or answer.memory
    return Figures(outcomes[ACCEPTED], outcomes[REFUSED], failures, growth)


def accepted_damage(first: int, count: int) -> list[int]:
    """Return which of the damaged files by their numbers are read as if they were whole; others raise."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "agent.tuckerl"
        for number in range(first, first + count):
            path.write_bytes(damaged(number))
            try:
                learner_file.read(path)
            except SavedFileError:
                continue
            found.append(number)
    return found


def main() -> None:
    """Do what the arguments say: serve; damage FIRST COUNT; craft FIRST COUNT; show NUMBER."""
    what, *numbers = sys.argv[1:]
    if what == "serve":
        serve()
    elif what == "damage":
        print("accepted:", accepted_damage(*map(int, numbers)))  # noqa: T201  # a program
    elif what == "craft":
        figures = try_crafted(*map(int, numbers))
        for number, failure in figures.failures.items():
            print(number, failure)  # noqa: T201  # as above
        print(figures._replace(failures={}))  # noqa: T201  # as above
    else:
        name, content = crafted_file(int(numbers[0]))
        path = Path(f"crafted-{numbers[0]}.tuckerl")
        path.write_bytes(content)
        tuckerl.load(path, env=environment_of(name))
        print(path, play(path, name))  # noqa: T201  # as above


if __name__ == "__main__":
    main()
