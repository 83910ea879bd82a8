"""Loading a saved learner without knowing which one it is."""

from os import PathLike
from typing import Any

from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_path
from tuckerl.errors import SavedFileError
from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.learners import LEARNERS
from tuckerl.training import persistence
from tuckerl.training.learner import Learner


def load(
    path: str | PathLike[str],
    *,
    env: Environment | None = None,
    tensor_step: TensorStep | None = None,
    **parameters: Any,
) -> Learner:
    """Return the learner that any learner's `save` wrote: this library's, or a subclass that has been imported.

    Parameters
    ----------
    path
    env, tensor_step
        What no file holds; see :meth:`tuckerl.training.learner.Learner.load`.
    **parameters
        Replace the saved ones: ``load(path, alpha=0.01)``.

    Raises
    ------
    SavedFileError
        If the file is truncated, damaged, of another kind, of a newer version, or holds an unknown learner.
    ParameterError
        If `env` or `tensor_step` is not the one that it was saved with, or a parameter is one that cannot change.
    FileNotFoundError
        If there is none.

    Examples
    --------
    >>> import tuckerl
    >>> tuckerl.Sarsa("FrozenLake-v1", seed=0).learn(episodes=10).save("agent.tuckerl")
    >>> type(tuckerl.load("agent.tuckerl")).__name__
    'Sarsa'
    """
    saved = persistence.read(check_path("path", path))
    own = [entry.load() for entry in LEARNERS]
    known = next((kind for kind in (*own, *_subclasses()) if saved.is_of(kind)), None)  # ours go before others
    if known is None:
        module, _, name = saved.header["learner"].rpartition(":")
        names = ", ".join(kind.__name__ for kind in own)
        where = f"import the module {module}, which defines it" if module else "import the module that defines it"
        raise SavedFileError(f"{path} holds a {name!s:.80}, which is none of {names}: {where:.120} first")
    return persistence.load(known, saved, env=env, tensor_step=tensor_step, changes=parameters)


def _subclasses() -> list[type[Learner]]:
    """Return all learners whose modules have been imported."""
    found = list(Learner.__subclasses__())
    for kind in found:  # it grows meanwhile
        found.extend(kind.__subclasses__())
    return found
