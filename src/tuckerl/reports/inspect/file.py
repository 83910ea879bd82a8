"""Inspecting a file, a saved learner or a tensor of Q-tables as NumPy saves it, and what is in it in a few lines."""

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tuckerl.errors import ParameterError, SavedFileError, SavedFileMissingError, TensorError
from tuckerl.reports.inspect.content import Inspection
from tuckerl.reports.inspect.learner import inspect_learner
from tuckerl.reports.inspect.tensor import inspect_tensor
from tuckerl.reports.learner_text import name_of
from tuckerl.reports.text import counted, joined, number, ranks_of, share_of, span
from tuckerl.studies.algorithms import default_ranks
from tuckerl.studies.training import load_learner
from tuckerl.training.learner import Learner
from tuckerl.types import AskedRanks, FloatArray

_NPY, _ZIP = b"\x93NUMPY", b"PK\x03\x04"


def inspect_file(
    path: Path,
    layout: tuple[int, int] | None = None,
    ranks: AskedRanks | None = None,
    environment: str | None = None,
    keywords: Mapping[str, Any] = {},
) -> tuple[Inspection, list[str]]:
    """Return what is in a file, and the same in a few lines.

    Parameters
    ----------
    path : Path
    layout : (rows, columns), optional
        Where the states are the cells of a grid, row by row.
    ranks : four ints, float or "auto", optional
        With which a tensor is decomposed.
    environment, keywords : str and mapping, optional
        The id of what a learner learned on, and with what it is made.

    Raises
    ------
    SavedFileError
        If it is neither a saved learner nor an array, cannot be read, or an environment is needed.
    SavedFileMissingError
        If there is none.
    TensorError, ParameterError, ProblemError
        If it holds no tensor of Q-tables, or an option does not fit it.
    """
    try:
        with path.open("rb") as file:
            start = file.read(len(_NPY))
    except FileNotFoundError as error:
        raise SavedFileMissingError(f"there is no file {path}: name a saved agent, a .npy or a .npz") from error
    except OSError as error:
        raise SavedFileError(f"{path} cannot be read: {error.strerror}") from error
    if not start.startswith((_NPY, _ZIP)):
        learner = load_learner(path, environment, keywords)
        if ranks is not None:
            raise ParameterError(f"ranks are for a tensor of Q-tables; {path} is a saved agent, which has its own")
        return inspect_learner(learner, layout=layout), learner_lines(learner)
    if environment is not None:
        raise ParameterError(f"an environment is for a saved agent; {path} is an array: leave --env out")
    tensor = _read(path)
    if ranks is None and tensor.ndim == 4 and tensor.size:
        sizes: Any = zip(default_ranks(tensor.shape[0], tensor.shape[1]), tensor.shape, strict=True)
        ranks = tuple(min(pair) for pair in sizes)
    if tensor.dtype.kind not in "iuf":
        raise TensorError(f"a tensor of Q-tables must hold real numbers; {path} has dtype {tensor.dtype}")
    if not np.isfinite(tensor).all():
        raise TensorError(f"a tensor of Q-tables must be finite; {path} has NaN or infinity in it")
    inspection = inspect_tensor(tensor, ranks or (1, 1, 1, 1), layout, title=f"{path.name}: Q-tables")
    return inspection, tensor_lines(inspection, tensor.shape)


def _read(path: Path) -> FloatArray:
    try:
        held: Any = np.load(io.BytesIO(path.read_bytes()), allow_pickle=False)
        if isinstance(held, np.ndarray):
            return held
        with held as archive:
            if len(archive.files) != 1:
                names = ", ".join(archive.files) or "none"
                raise SavedFileError(f"{path} must hold one array, the tensor of Q-tables; it holds {names}")
            array: FloatArray = archive[archive.files[0]]
            return array
    except SavedFileError:
        raise
    except (ValueError, OSError, EOFError, KeyError, zipfile.BadZipFile) as error:
        pickled = "pickle" in str(error)
        why = "Python objects, which may run code: save plain numbers" if pickled else f"no readable array ({error})"
        raise SavedFileError(f"{path} holds {why}") from error


_MOST_ACTIONS = 10


def learner_lines(learner: Learner) -> list[str]:
    """Return what a learner is, on what and how much it learned, and what it holds."""
    problem, step = learner.problem, learner.tensor_step
    limit = problem.max_episode_steps
    lines = [
        name_of(learner),
        f"Problem: {counted(problem.n_states, 'state')}, {counted(problem.n_actions, 'action')}"
        + (f", at most {counted(limit, 'step')} an episode" if limit else ""),
        f"Parameters: {joined(f'{name} {value}' for name, value in learner.parameters.items())}",
    ]
    if step is not None:
        lines.append(
            f"Tensor step: every {counted(step.every, 'episode')}, {ranks_of(step.ranks)}, weights "
            f"{_name(step.weights)}, {share_of(step)}, floor {step.floor:g}"
        )
        failed = int(learner.tensor_step_history.failed.sum())
        if failed:
            lines.append(
                f"No decomposition could be found after {counted(failed, 'window')}: weights and tables stayed"
            )
    steps = int(learner.steps.sum())
    lines.append(
        f"Learned: {counted(learner.episodes, 'episode')}, {counted(learner.n_agents, 'agent')}, "
        f"{counted(steps, 'step')}"
    )
    if learner.diverged_at is not None:
        lines.append(
            f"The values of a table were no longer finite in episode {learner.diverged_at:,}, where learning stopped"
        )
    lines.append(f"Action weights: {_weights(learner)}")
    value = _value_of_start(learner)
    return lines if value is None else [*lines, f"Greedy value of the start (agent 0): {number(value)}"]


def tensor_lines(inspection: Inspection, shape: tuple[int, ...]) -> list[str]:
    """Return a tensor's sizes, and how well its decomposition fits it."""
    kinds = zip(shape, ("state", "action", "episode", "agent"), strict=True)
    lines = [f"Tensor: {joined(counted(size, kind) for size, kind in kinds)}"]
    if inspection.loadings is None:
        return [*lines, "All of it is zero: there is nothing to decompose"]
    return [*lines, f"Decomposition with ranks {inspection.loadings.core.shape}: fit {number(inspection.loadings.fit)}"]


def _name(value: Any) -> str:
    return value if isinstance(value, str) else getattr(value, "__name__", "a function")


def _weights(learner: Learner) -> str:
    weights, names = learner.action_weights, learner.problem.action_names
    if weights.size > _MOST_ACTIONS or np.ptp(weights) == 0:
        return span(weights)
    return joined(f"{name} {number(float(weight))}" for name, weight in zip(names, weights, strict=True))


def _value_of_start(learner: Learner) -> float | None:
    """Return agent 0's largest value of the first state, on average over these; None where that is not known."""
    mask = learner.action_mask
    best = np.where(True if mask is None else mask[0], learner.q[0], -np.inf).max(axis=-1)
    start = learner.problem.start_distribution()
    if start is not None:
        states, probability = start
        return float(best[states] @ probability)
    path = learner.trajectories[0]
    return float(best[path[0]]) if path.size else None
