"""The file of a saved learner: a header of JSON and NumPy arrays, never pickled objects.

Line 1 names the format and its version, line 2 is the SHA-256 of all that follows: an ``.npz`` archive whose member
``header`` is the JSON text. A file of a newer version is refused, and so is one that is cut short or damaged.

The second half says how a problem, a tensor step and a seed are put into header and arrays, and how they come back.
"""

import hashlib
import io
import json
import zipfile
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from tuckerl.errors import ParameterError, SavedFileError, SavedFileMissingError
from tuckerl.files import write_whole
from tuckerl.generalization.step import TensorStep
from tuckerl.problems.mdp import MDPArrays, TabularMDP
from tuckerl.problems.resolve import Environment, Problem, as_problem
from tuckerl.problems.simulator import Simulator

FORMAT_VERSION = 1
_MAGIC = b"tuckerl learner, format "

Header = dict[str, Any]
Arrays = dict[str, np.ndarray]


def write(path: Path, header: Header, arrays: Arrays) -> None:
    """Write a header and arrays to `path`, whole or not at all.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    text = np.frombuffer(json.dumps(header, sort_keys=True).encode(), dtype=np.uint8)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, header=text, **arrays)  # type: ignore[arg-type]  # its stub takes allow_pickle by name
    body = buffer.getvalue()
    digest = hashlib.sha256(body).hexdigest().encode()
    write_whole(path, _MAGIC + str(FORMAT_VERSION).encode() + b"\n" + digest + b"\n" + body)


def read(path: Path) -> tuple[Header, Arrays]:
    """Return the header and the arrays of a file that `write` wrote.

    Raises
    ------
    SavedFileError
        If the file is of another kind, of a newer version, truncated or damaged.
    SavedFileMissingError
        If there is none.
    """
    try:
        content = path.read_bytes()
    except FileNotFoundError as error:
        raise SavedFileMissingError(f"there is no file {path}: name one that a learner's save() wrote") from error
    if not content.startswith(_MAGIC):
        raise SavedFileError(f"{path} is not a saved learner: expected a file that a learner's save() wrote")
    first, _, rest = content.partition(b"\n")
    digest, _, body = rest.partition(b"\n")
    version = first[len(_MAGIC) :]
    if version.isdigit() and int(version) > FORMAT_VERSION:
        raise SavedFileError(
            f"{path} has format {int(version)}, and this version of tuckerl reads up to format {FORMAT_VERSION}: "
            "update tuckerl"
        )
    if not version.isdigit() or hashlib.sha256(body).hexdigest().encode() != digest:
        raise SavedFileError(f"{path} is truncated or damaged (its checksum differs): save it again")
    try:
        with np.load(io.BytesIO(body), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        return json.loads(arrays.pop("header").tobytes()), arrays
    except (ValueError, KeyError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise SavedFileError(f"{path} holds no readable learner ({error}): save it again") from error


def with_prefix(prefix: str, arrays: Arrays) -> Arrays:
    """Return `arrays` under the names ``prefix.name``."""
    return {f"{prefix}.{name}": array for name, array in arrays.items()}


def of_prefix(prefix: str, arrays: Arrays) -> Arrays:
    """Return those of the `arrays` that `with_prefix` named, under their own names."""
    start = f"{prefix}."
    return {name.removeprefix(start): array for name, array in arrays.items() if name.startswith(start)}


def problem_parts(problem: Problem) -> tuple[Header, Arrays]:
    """Return a problem as header and arrays; a simulator's functions are code, so of it only the sizes are kept."""
    if isinstance(problem, Simulator):
        return {"simulator": [problem.n_states, problem.n_actions, problem.max_episode_steps]}, {}
    parts = problem.arrays._asdict()
    arrays: Arrays = {name: part for name, part in parts.items() if isinstance(part, np.ndarray)}
    header = {name: part for name, part in parts.items() if name not in arrays}
    if problem.heuristic is not None:
        arrays["heuristic"] = problem.heuristic
    own = {"n_states": problem.n_states, "action_sizes": list(problem.action_sizes), "layout": problem.layout}
    return header | own, arrays


def restored_problem(header: Header, arrays: Arrays, env: Environment | None, path: Path) -> Problem:
    """Return the problem that `problem_parts` took apart; a simulator, from the environment that is given.

    Raises
    ------
    SavedFileError
        If an environment is needed and none is given.
    ParameterError
        If the one given is another kind of problem or has other sizes, or none is needed.
    """
    if "simulator" not in header:
        if env is not None:
            raise ParameterError(f"{path} holds all of its problem: load it without env")
        no_masks = np.zeros((0, 0), dtype=np.bool_)  # of which format 1 knew nothing
        parts: dict[str, Any] = {"forbidden": no_masks} | header | arrays
        mdp = MDPArrays(**{name: parts[name] for name in MDPArrays._fields})
        layout = header.get("layout")
        return TabularMDP.from_arrays(
            mdp,
            header["n_states"],
            arrays.get("heuristic"),
            tuple(header["action_sizes"]),
            None if layout is None else (layout[0], layout[1]),
        )
    if env is None:
        raise SavedFileError(f"{path} was learned on a simulator, whose functions no file holds: pass load() its env")
    problem = as_problem(env)
    now = [problem.n_states, problem.n_actions, problem.max_episode_steps]
    if not isinstance(problem, Simulator) or now != header["simulator"]:
        raise ParameterError(
            f"env must be the one that {path} was saved with, a simulator with (states, actions, time limit) "
            f"{header['simulator']}; got {problem}"
        )
    return problem


def seed_parts(sequence: np.random.SeedSequence) -> Header:
    """Return what makes `sequence` again."""
    entropy: Any = sequence.entropy
    words = [int(word) for word in entropy] if isinstance(entropy, Iterable) else int(entropy)
    return {"entropy": words, "spawn_key": [int(key) for key in sequence.spawn_key]}


def restored_seed(header: Header) -> np.random.SeedSequence:
    """Return the sequence that `seed_parts` took apart."""
    return np.random.SeedSequence(header["entropy"], spawn_key=header["spawn_key"])


def step_parts(step: TensorStep | None) -> Header | None:
    """Return a tensor step's parameters; None stands for a user's function, which a file of data cannot hold."""
    if step is None:
        return None
    parameters = {field.name: getattr(step, field.name) for field in fields(step)}
    return {name: None if callable(value) else value for name, value in parameters.items()}


def restored_step(header: Header | None, given: TensorStep | None, path: Path) -> TensorStep | None:
    """Return the tensor step that `step_parts` took apart, with the functions of the one `given` in its place.

    Raises
    ------
    SavedFileError
        If functions are needed and none is given.
    ParameterError
        If the one given differs in anything but those functions, or none is needed.
    """
    functions = [] if header is None else [name for name, value in header.items() if value is None]
    if given is None:
        if functions:
            raise SavedFileError(
                f"{path} used a tensor step with functions of its own ({', '.join(functions)}), which files cannot "
                "hold: pass load() a tensor_step with them"
            )
        return None if header is None else TensorStep(**header)
    if header is None or not functions:
        raise ParameterError(f"{path} holds all of its tensor step: load it without tensor_step")
    for name, value in header.items():
        now = getattr(given, name)
        same = callable(now) if value is None else now == (tuple(value) if name == "ranks" else value)
        if not same:
            before = "a function" if value is None else repr(value)
            raise ParameterError(
                f"tensor_step must be the one that {path} was saved with: its {name} was {before}; got {now!r}"
            )
    return given
