"""How a problem, a tensor step and a seed are put into a file's header and arrays, and how they come back."""

from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from tuckerl.adapters.gymnasium_problem import Edges, GymnasiumProblem
from tuckerl.adapters.pettingzoo_problem import EdgesOfAgents, PettingZooProblem
from tuckerl.adapters.resolve import Environment, Problem, Reading, as_problem
from tuckerl.errors import ParameterError, SavedFileError
from tuckerl.generalization.step import TensorStep
from tuckerl.problems.mdp import MDPArrays, TabularMDP
from tuckerl.problems.simulator import Simulator
from tuckerl.training.learner_file import Arrays, Header, of_prefix, with_prefix
from tuckerl.training.schedules import as_json, from_json

_STEPPED = (GymnasiumProblem, PettingZooProblem)
_STORED_KINDS: dict[type, str] = {GymnasiumProblem: "SteppedProblem", PettingZooProblem: "PlayersProblem"}
"""What the kinds of problem are called in files."""

_STORED_NAMES = {"compiled": "lift", "cut_traces": "cut", "search_control": "walk"}
_STORED_VALUES: dict[str, dict[Any, Any]] = {
    "compiled": {"auto": True},
    "exploration": {"independent": "members", "joint": "team"},
}
"""What formats 1 and 2 call parameters and their values that have other names today."""

_GIVE_ENV = "pass load() its env, or name it with --env in a command"


def problem_parts(problem: Problem) -> tuple[Header, Arrays]:
    """Return a problem as header and arrays; of one that is code, only its sizes, its id and its bins."""
    if isinstance(problem, Simulator):
        return {"simulator": _sizes(problem), "source": problem.source}, {}
    if isinstance(problem, _STEPPED):
        header = {"id": problem.id, "source": problem.source, "sizes": _sizes(problem), "agents": _agents(problem)}
        return {_STORED_KINDS[type(problem)]: header}, _edges_of(problem)
    parts = problem.arrays._asdict()
    arrays: Arrays = {name: part for name, part in parts.items() if isinstance(part, np.ndarray)}
    numbers = {name: part for name, part in parts.items() if name not in arrays}
    arrays["forbidden"] = ~arrays.pop("action_mask")
    if problem.heuristic is not None:
        arrays["heuristic"] = problem.heuristic
    own = {"n_states": problem.n_states, "action_sizes": list(problem.action_sizes), "layout": problem.layout}
    own |= {"is_capped": problem.is_capped, "source": problem.source}
    return numbers | own, arrays


def _sizes(problem: Problem) -> list[int | None]:
    return [problem.n_states, problem.n_actions, problem.max_episode_steps]


def _agents(problem: GymnasiumProblem | PettingZooProblem) -> list[str]:
    return [str(name) for name in problem.agents]


def _edges_of(problem: GymnasiumProblem | PettingZooProblem) -> Arrays:
    encoders = problem.observations if isinstance(problem, PettingZooProblem) else (problem.observations,)
    arrays: Arrays = {}
    for place, encoder in enumerate(encoders):
        arrays |= with_prefix(f"edges{place}", {f"{i:06}": edges for i, edges in enumerate(encoder.edges)})
    return arrays


def restored_problem(header: Header, arrays: Arrays, env: Environment | None, path: Path, reading: Reading) -> Problem:
    """Return the problem that `problem_parts` took apart; one that is code, from the environment that is given.

    Raises
    ------
    SavedFileError
        If an environment is needed and none is given.
    ParameterError
        If the one given is another kind of problem or has other sizes, or none is needed.
    """
    if "simulator" in header:
        if env is None:
            raise SavedFileError(f"{path} was learned on a simulator, whose functions no file holds: {_GIVE_ENV}")
        return _same(as_problem(env, reading), Simulator, header["simulator"], path)
    for kind, stored in _STORED_KINDS.items():
        if stored in header:
            return _restored_environment(header[stored], kind, arrays, env, path, reading)
    if env is not None:
        raise ParameterError(f"{path} holds all of its problem: load it without env")
    return _restored_table(header, arrays)


def _restored_environment(
    header: Header, kind: type, arrays: Arrays, env: Environment | None, path: Path, reading: Reading
) -> Problem:
    if env is None and header["id"] is None:
        raise SavedFileError(
            f"{path} was learned on an environment that no file holds, {header['source']}: {_GIVE_ENV}"
        )
    n_codings = len(header["agents"]) if kind is PettingZooProblem else 1
    edges = tuple(Edges(tuple(of_prefix(f"edges{place}", arrays).values())) for place in range(n_codings))
    bins: Any = None
    if arrays:
        bins = EdgesOfAgents(edges) if kind is PettingZooProblem else edges[0]
    given = header["id"] if env is None else env
    try:
        problem = as_problem(given, replace(reading, bins=bins, compiled=False))
    except ParameterError as error:  # the edges belong to another space
        raise ParameterError(f"env must be the one that {path} was saved with, {header['source']}: {error}") from error
    problem = _same(problem, kind, header["sizes"], path)
    if isinstance(problem, _STEPPED) and _agents(problem) != header["agents"]:
        raise ParameterError(
            f"env must be the one that {path} was saved with, of the agents {', '.join(header['agents'])}, in this "
            f"order; got {', '.join(_agents(problem))}"
        )
    return problem


def _same(problem: Problem, kind: type, sizes: list[int | None], path: Path) -> Problem:
    if not isinstance(problem, kind) or _sizes(problem) != sizes:
        what = "a simulator" if kind is Simulator else "an environment"
        raise ParameterError(
            f"env must be the one that {path} was saved with, {what} with (states, actions, time limit) {sizes}; "
            f"got {problem}"
        )
    return problem


def _restored_table(header: Header, arrays: Arrays) -> TabularMDP:
    no_masks = np.zeros((0, 0), dtype=np.bool_)  # of which format 1 knew nothing
    parts: dict[str, Any] = {"action_mask": no_masks} | header | arrays
    if "forbidden" in arrays:
        parts["action_mask"] = ~arrays["forbidden"]
    mdp = MDPArrays(**{name: parts[name] for name in MDPArrays._fields})
    layout = header.get("layout")
    problem = TabularMDP.from_arrays(
        mdp,
        header["n_states"],
        arrays.get("heuristic"),
        tuple(header["action_sizes"]),
        None if layout is None else (layout[0], layout[1]),
    )
    problem.is_capped = header.get("is_capped", False)
    problem.source = header.get("source")
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


def stored_parameters(parameters: Mapping[str, Any]) -> Header:
    """Return a learner's parameters as JSON, under the names that files know them by."""
    header = {}
    for name, value in parameters.items():
        values = _STORED_VALUES.get(name)
        header[_STORED_NAMES.get(name, name)] = as_json(value) if values is None else values.get(value, value)
    return header


def restored_parameters(header: Header) -> dict[str, Any]:
    """Return the parameters that `stored_parameters` took apart."""
    names = {stored: name for name, stored in _STORED_NAMES.items()}
    parameters = {names.get(stored, stored): from_json(value) for stored, value in header.items()}
    for name, values in _STORED_VALUES.items():
        if name in parameters:
            meant = {stored: value for value, stored in values.items()}
            parameters[name] = meant.get(parameters[name], parameters[name])
    return parameters
