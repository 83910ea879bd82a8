"""What ``tuckerl train`` is asked for: checked, made into a learner, and written down."""

import json
from collections.abc import Mapping
from typing import Any, NamedTuple

from tuckerl.adapters.making import make_environment
from tuckerl.adapters.quantiles import quantile_edges
from tuckerl.adapters.resolve import Environment, as_problem
from tuckerl.checks import check_int
from tuckerl.errors import ParameterError
from tuckerl.studies.algorithms import check_plays, named_algorithm, split_settings, tensor_step
from tuckerl.studies.environments import bins_named, environment_specification, maker
from tuckerl.training.learner import Learner

N_EPISODES = 1000
FORMAT = 1


class TrainingConfig(NamedTuple):
    """What is to be trained, in a user's words."""

    algorithm: str  # its name
    environment: str  # an id
    keywords: Mapping[str, Any] = {}  # of the environment
    settings: Mapping[str, Any] = {}  # by the name of a parameter
    quantile_bins: int | tuple[int, ...] | None = None  # for `bins`, of what random play observes
    n_agents: int = 1
    seed: int = 0
    episodes: int | None = None
    steps: int | None = None


def environment_of(name: str, keywords: Mapping[str, Any]) -> Environment:
    """Return an id, from which files can make the environment again; with keywords, what makes it."""
    return maker(0, name, dict(keywords)) if keywords else name


def checked(order: TrainingConfig) -> TrainingConfig:
    """Return the order with a goal, if its numbers are possible and its environment can be made.

    Raises
    ------
    UnknownNameError
        If there is no such algorithm or environment.
    ParameterError, ParameterTypeError
        If a number is impossible, or two of them exclude one another.
    ProblemError
        If the environment cannot be made, or the algorithm cannot play it.
    """
    named_algorithm(order.algorithm)
    check_int("agents", order.n_agents, 1)
    check_int("seed", order.seed, 0)
    if order.episodes is not None and order.steps is not None:
        raise ParameterError(f"give --episodes or --steps, not both; got {order.episodes} and {order.steps}")
    if order.steps is not None:
        check_int("steps", order.steps, 1)
    else:
        order = order._replace(
            episodes=check_int("episodes", N_EPISODES if order.episodes is None else order.episodes, 1)
        )
    if order.quantile_bins is not None and "bins" in order.settings:
        raise ParameterError("give --set bins=... or --quantile-bins, not both")
    make_environment(order.environment, order.keywords).close()
    check_plays(named_algorithm(order.algorithm), order.environment)
    return order


def made(order: TrainingConfig, environment: Environment) -> Learner:
    """Return the learner of an order that was checked.

    Raises
    ------
    ParameterError, ParameterTypeError
        If a setting is impossible or not known.
    ProblemError
        If the environment is nothing that the algorithm can play.
    """
    algorithm = named_algorithm(order.algorithm)
    parameters, of_step = split_settings(algorithm, order.settings)
    if order.quantile_bins is not None:
        source: Any = environment  # PettingZoo's are refused there
        parameters["bins"] = quantile_edges(source, order.quantile_bins, seed=order.seed)
    step = None
    with bins_named():
        if algorithm.is_t_version:
            problem = as_problem(environment, algorithm.learner.adapter_options(parameters))
            step = tensor_step(algorithm, (problem.n_states, problem.n_actions), of_step)
        return algorithm.learner(environment, **parameters, n_agents=order.n_agents, tensor_step=step, seed=order.seed)


def asked(order: TrainingConfig) -> dict[str, Any]:
    """Return what was asked for as JSON; the environment must have been made before."""
    environment = environment_specification(order.environment, order.keywords)
    environment.pop("versions")
    told = {
        "format": FORMAT,
        "algorithm": order.algorithm,
        "environment": environment,
        "settings": dict(order.settings),
        "quantile_bins": order.quantile_bins,
        "agents": order.n_agents,
        "seed": order.seed,
        "goal": {"episodes": order.episodes, "steps": order.steps},
    }
    normal: dict[str, Any] = json.loads(json.dumps(told))
    return normal
