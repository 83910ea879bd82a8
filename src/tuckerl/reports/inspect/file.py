"""Inspecting a file: a saved learner, or a tensor of Q-tables as NumPy saves it."""

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tuckerl.errors import ParameterError, SavedFileError, SavedFileMissingError, TensorError
from tuckerl.reports.inspect.content import Inspection
from tuckerl.reports.inspect.learner import inspect_learner
from tuckerl.reports.inspect.summary import learner_lines, tensor_lines
from tuckerl.reports.inspect.tensor import inspect_tensor
from tuckerl.studies.algorithms import default_ranks
from tuckerl.studies.training import load_learner
from tuckerl.types import FloatArray

_NPY, _ZIP = b"\x93NUMPY", b"PK\x03\x04"


def inspect_file(
    path: Path,
    layout: tuple[int, int] | None = None,
    ranks: tuple[int, int, int, int] | None = None,
    environment: str | None = None,
    keywords: Mapping[str, Any] = {},
) -> tuple[Inspection, list[str]]:
    """Return what is in a file, and the same in a few lines.

    Parameters
    ----------
    path : Path
    layout : (rows, columns), optional
        Where the states are the cells of a grid, row by row.
    ranks : four ints, optional
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
