"""The configuration of ``tuckerl train``: validated, written down, and made into a learner."""

import json
from collections.abc import Mapping
from typing import Any, NamedTuple

from tuckerl.adapters.making import make_environment
from tuckerl.adapters.quantiles import quantile_edges
from tuckerl.adapters.resolve import Environment, as_problem
from tuckerl.checks import check_int
from tuckerl.errors import ParameterError
from tuckerl.studies.algorithms import check_plays, named_algorithm, split_settings, tensor_step
from tuckerl.studies.environments import bins_named, environment_specification
from tuckerl.training.learner import Learner
from tuckerl.training.parameter_json import in_words

N_EPISODES = 1000
FORMAT = 1


class TrainingConfig(NamedTuple):
    """The algorithm, the environment and the goal of a training, as its user gives them."""

    algorithm: str  # its name
    environment: str  # an id
    keywords: Mapping[str, Any] = {}  # of the environment
    settings: Mapping[str, Any] = {}  # by the name of a parameter: JSON, or a schedule
    quantile_bins: int | tuple[int, ...] | None = None  # for `bins`, of what random play observes
    n_agents: int = 1
    seed: int = 0
    episodes: int | None = None
    steps: int | None = None

    def validate(self) -> "TrainingConfig":
        """Return the configuration with a goal, if its numbers are possible and its environment can be made.

        Raises
        ------
        UnknownNameError
            If there is no such algorithm or environment.
        ParameterError, ParameterTypeError
            If a number is impossible, or two of them exclude one another.
        ProblemError
            If the environment cannot be made, or the algorithm cannot play it.
        """
        algorithm = named_algorithm(self.algorithm)
        check_int("agents", self.n_agents, 1)
        check_int("seed", self.seed, 0)
        if self.episodes is not None and self.steps is not None:
            raise ParameterError(f"give --episodes or --steps, not both; got {self.episodes} and {self.steps}")
        if self.steps is not None:
            check_int("steps", self.steps, 1)
        wanted = N_EPISODES if self.episodes is None else self.episodes
        episodes = check_int("episodes", wanted, 1) if self.steps is None else None
        if self.quantile_bins is not None and "bins" in self.settings:
            raise ParameterError("give --set bins=... or --quantile-bins, not both")
        make_environment(self.environment, self.keywords).close()
        check_plays(algorithm, self.environment)
        return self._replace(episodes=episodes)

    def to_dict(self) -> dict[str, Any]:
        """Return the configuration as JSON; the environment must have been made before."""
        environment = environment_specification(self.environment, self.keywords)
        entries = {
            "format": FORMAT,
            "algorithm": self.algorithm,
            "environment": environment,
            "settings": {name: in_words(value) for name, value in self.settings.items()},
            "quantile_bins": self.quantile_bins,
            "agents": self.n_agents,
            "seed": self.seed,
            "goal": {"episodes": self.episodes, "steps": self.steps},
        }
        normal: dict[str, Any] = json.loads(json.dumps(entries))
        return normal


def build_learner(config: TrainingConfig, environment: Environment) -> Learner:
    """Return the learner of a validated configuration.

    Raises
    ------
    ParameterError, ParameterTypeError
        If a setting is impossible or not known.
    ProblemError
        If the environment is nothing that the algorithm can play.
    """
    algorithm, n_agents, seed = named_algorithm(config.algorithm), config.n_agents, config.seed
    parameters, of_step = split_settings(algorithm, config.settings)
    if config.quantile_bins is not None:
        source: Any = environment  # what has no Box is refused there
        parameters["bins"] = quantile_edges(source, config.quantile_bins, seed=seed)
    step = None
    with bins_named(config.environment):
        if algorithm.is_t_version or of_step:
            of_step = of_step if algorithm.is_t_version else {"weights": "none"} | of_step
            problem = as_problem(environment, algorithm.learner.adapter_options(parameters))
            step = tensor_step(algorithm, (problem.n_states, problem.n_actions), of_step)
        return algorithm.learner(environment, **parameters, n_agents=n_agents, tensor_step=step, seed=seed)
