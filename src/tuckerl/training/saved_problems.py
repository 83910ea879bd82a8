"""How a problem is put into a file's header and arrays, and how it comes back."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tuckerl.adapters.gymnasium_problem import Edges, GymnasiumProblem
from tuckerl.adapters.pettingzoo_problem import EdgesOfAgents, PettingZooProblem
from tuckerl.adapters.resolve import Environment, Problem, Reading, as_problem
from tuckerl.errors import ParameterError, SavedFileError
from tuckerl.problems.mdp import MDPArrays, TabularMDP
from tuckerl.problems.simulator import Simulator
from tuckerl.training.learner_file import Arrays, Header, of_prefix, with_prefix

_STEPPED = (GymnasiumProblem, PettingZooProblem)
_STORED_KINDS: dict[type, str] = {GymnasiumProblem: "SteppedProblem", PettingZooProblem: "PlayersProblem"}
"""What the kinds of problem are called in files."""

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
