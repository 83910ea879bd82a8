"""The algorithms by the names that commands know them by: every learner, and its version with a tensor step."""

from collections.abc import Iterator, Mapping
from dataclasses import fields
from typing import Any, NamedTuple

from tuckerl.adapters.resolve import Agents
from tuckerl.checks import check_name, did_you_mean, shown
from tuckerl.errors import ParameterError, ParameterTypeError, ProblemError, UnknownNameError
from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.learners import LEARNERS
from tuckerl.studies.environments import has_several_agents
from tuckerl.training.learner import Learner
from tuckerl.training.parameters import keywords_of


class Algorithm(NamedTuple):
    """An algorithm, or the T-version of one."""

    name: str
    title: str
    learner: type[Learner]
    source: str
    share: str | None = None  # the paper's rule, of a T-version; None is the unmodified algorithm

    @property
    def is_t_version(self) -> bool:
        """Whether it takes the tensor step."""
        return self.share is not None

    @property
    def plays_teams(self) -> bool:
        """Whether it plays the joint actions of environments of several agents, and nothing else."""
        return self.learner.reads_agents is Agents.JOINT


def _algorithms() -> Iterator[Algorithm]:
    for entry in LEARNERS:
        learner, t_version = entry.load(), entry.t_version
        yield Algorithm(entry.name, entry.title, learner, entry.source)
        if t_version is not None:
            yield Algorithm(t_version.name, t_version.title, learner, t_version.source, t_version.share)


ALGORITHMS: dict[str, Algorithm] = {algorithm.name: algorithm for algorithm in _algorithms()}

STEP_PARAMETERS: tuple[str, ...] = tuple(field.name for field in fields(TensorStep))
"""What can be set of a T-version's tensor step."""

_ELSEWHERE = {
    "n_agents": "give the number of agents with --agents",
    "seed": "give the seed with --seed",
    "tensor_step": f"set its own parameters: {', '.join(STEP_PARAMETERS)}",
}


def named_algorithm(name: str) -> Algorithm:
    """Return the algorithm of this name.

    Raises
    ------
    UnknownNameError
        If there is none.
    """
    return ALGORITHMS[check_name("algorithm", name, ALGORITHMS, "; `tuckerl list algorithms` shows them")]


def check_order(command: str, algorithm: str, environment: str) -> None:
    """Refuse an algorithm and an environment that have changed places, with the line to type.

    Raises
    ------
    UnknownNameError
        If that is so.
    """
    if algorithm not in ALGORITHMS and environment in ALGORITHMS:
        raise UnknownNameError(
            f"the algorithm comes first, then the environment: `tuckerl {command} {environment} {algorithm}`"
        )


def parameters_of(algorithm: Algorithm) -> tuple[str, ...]:
    """Return the names of all that can be set: the learner's own parameters, those of all learners, the step's."""
    names = [name for name in keywords_of(algorithm.learner) if name not in _ELSEWHERE]
    return (*names, *(STEP_PARAMETERS if algorithm.is_t_version else ()))


def check_setting(algorithms: tuple[Algorithm, ...], name: str) -> None:
    """Refuse a name that none of the algorithms can be set by, saying what may have been meant.

    Raises
    ------
    ParameterTypeError
        If there is no such parameter.
    ParameterError
        If it is set in another way, or belongs to a tensor step that none of them takes.
    """
    if any(name in parameters_of(algorithm) for algorithm in algorithms):
        return
    who = " and ".join(dict.fromkeys(algorithm.name for algorithm in algorithms))
    if name in _ELSEWHERE:
        raise ParameterError(f"{name} of {who} cannot be set by name: {_ELSEWHERE[name]}")
    if name in STEP_PARAMETERS:
        t_versions = ", ".join(a.name for a in ALGORITHMS.values() if a.is_t_version)
        raise ParameterError(f"{name} belongs to the tensor step, which {who} is without: {t_versions} take it")
    known = list(dict.fromkeys(known for algorithm in algorithms for known in parameters_of(algorithm)))
    hint = did_you_mean(name, known) or f"known are {', '.join(known)}"
    raise ParameterTypeError(
        f"{who} has no parameter {shown(name)}: {hint}; `tuckerl list {algorithms[0].name}` tells of each"
    )


def check_plays(algorithm: Algorithm, environment: str) -> None:
    """Refuse a team's algorithm for an environment of one agent, which must exist.

    Raises
    ------
    ProblemError
        If that is so.
    """
    if algorithm.plays_teams and not has_several_agents(environment):
        raise ProblemError(
            f"{algorithm.name} plays the joint actions of several agents, and {environment} has one agent: "
            "q-learning or sarsa-lambda can play it"
        )


def split_settings(algorithm: Algorithm, settings: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return what of the settings is the learner's, and what its tensor step's.

    An unmodified algorithm takes a step's parameters where `share` is among them: its agents share, and no more.

    Raises
    ------
    ParameterError, ParameterTypeError
        If the algorithm takes no such parameter.
    """
    for name in settings:
        if name not in STEP_PARAMETERS or "share" not in settings:
            check_setting((algorithm,), name)
    step = {name: value for name, value in settings.items() if name in STEP_PARAMETERS}
    return {name: value for name, value in settings.items() if name not in step}, step


def default_ranks(n_states: int, n_actions: int) -> tuple[int, int, int, int]:
    """Return ranks where none are given.

    They are ours: the paper gives ranks for its three problems only. Ten actions of more than ten and one less than
    there are otherwise is what it has for each of these.
    """
    return (min(15, n_states), min(10, max(1, n_actions - 1)), 9, 1)


def tensor_step(algorithm: Algorithm, sizes: tuple[int, int], settings: Mapping[str, Any]) -> TensorStep:
    """Return a T-version's step: what is not set is the paper's, and the ranks follow from the sizes (S, A).

    Raises
    ------
    ParameterError, ParameterTypeError, UnknownNameError
        If a parameter is out of its range, of the wrong type or not a known name.
    """
    chosen = step_defaults(algorithm) | {"ranks": default_ranks(*sizes)}
    return TensorStep(**chosen | dict(settings))


def step_defaults(algorithm: Algorithm) -> dict[str, Any]:
    """Return what a T-version's step is where it is not set, but for the ranks."""
    return {"every": 10, "weights": "paper", "share": algorithm.share or "none"}
