"""Comparing two algorithms on one environment, from the same seeds: the study behind ``tuckerl compare``.

Where one of the two is a T-version, the constant control is played as well: the same learner with as many agents and
the same sharing, whose learning rate is as small as the tensor step makes it on average, but equal for all actions.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

from tuckerl.adapters.making import make_environment
from tuckerl.checks import check_int, check_name, shown
from tuckerl.errors import ParameterError, UnknownNameError
from tuckerl.studies.algorithms import (
    Algorithm,
    check_plays,
    check_setting,
    named_algorithm,
    parameters_of,
    split_settings,
    tensor_step,
)
from tuckerl.studies.assumptions import invented
from tuckerl.studies.environments import bins_named, environment_specification, maker
from tuckerl.studies.study import AlgorithmConfig, Comparison, Scenario, Study, Variant, variant

N_RUNS, N_EPISODES = 50, 500
SCENARIO_NUMBER = 3  # in the seeds, where the paper's scenarios have 0 to 2
MEASURED = ("return", "steps", "final")

BASE, CANDIDATE = "base", "candidate"


class ComparisonConfig(NamedTuple):
    """The two algorithms, the environment and the numbers of a comparison, as its user gives them."""

    base: str  # an algorithm's name
    candidate: str
    environment: str  # an id
    keywords: Mapping[str, Any] = {}  # of the environment
    settings: Mapping[str, Any] = {}  # by the name of a parameter, or by base.NAME or candidate.NAME for one side
    measure: str = "return"
    n_agents: int | None = None  # of the T-versions
    n_runs: int = N_RUNS
    n_episodes: int = N_EPISODES
    seed: int = 0


class ComparisonStudy(NamedTuple):
    """The study of two algorithms, of one scenario."""

    config: ComparisonConfig
    study: Study
    no_control: str  # why there is no control; "" where there is one

    @property
    def scenario(self) -> Scenario:
        """The one scenario."""
        return self.study.scenarios[0]

    @property
    def comparison(self) -> Comparison:
        """The one comparison; its control is "" where there is none."""
        return self.scenario.comparisons[0]

    def algorithm(self, name: str) -> Algorithm:
        """Return the algorithm that a variant plays; of the control, that whose control it is."""
        base, candidate = named_algorithm(self.config.base), named_algorithm(self.config.candidate)
        if name == self.comparison.control:
            return candidate if candidate.is_t_version else base
        return candidate if name == self.comparison.candidate else base


def comparison_study(config: ComparisonConfig) -> ComparisonStudy:
    """Return the study of a comparison; every learner in it has been made once, so none of it is impossible.

    Raises
    ------
    UnknownNameError
        If there is no such algorithm, environment or measure.
    ParameterError, ParameterTypeError
        If a setting or number is impossible, or both sides are the same.
    ProblemError
        If the environment cannot be made, or an algorithm cannot play it.
    """
    algorithms = named_algorithm(config.base), named_algorithm(config.candidate)
    check_name("measure", config.measure, MEASURED)
    _check_numbers(config, algorithms)
    settings = _settings_of_sides(config, algorithms)
    make_environment(config.environment, config.keywords).close()
    problem = partial(maker, name=config.environment, keywords=dict(config.keywords))
    sides = [_side(config, *pair, problem) for pair in zip(algorithms, settings, strict=True)]
    base, candidate = _with_two_names(sides[0].variant, sides[1].variant)
    control, no_control = _control(*sides)
    has_default_ranks = any(
        one.is_t_version and "ranks" not in own for one, own in zip(algorithms, settings, strict=True)
    )
    label = _label(config.environment, config.keywords)
    claim, control_name = f"{candidate.name} does better than {base.name}", control.name if control else ""
    scenario = Scenario(
        name=label,
        title=f"{algorithms[0].title} and {algorithms[1].title} on {label}",
        description="",
        number=SCENARIO_NUMBER,
        problem=problem,
        n_instances=1,
        n_runs=config.n_runs,
        n_episodes=config.n_episodes,
        algorithm=sides[1].algorithm,
        variants=(base, candidate, *([control] if control else [])),
        measure=config.measure,
        comparisons=(Comparison("", claim, config.measure, base.name, candidate.name, control_name),),
        assumptions=(_RANKS,) if has_default_ranks else (),
        environment=environment_specification(config.environment, config.keywords),
    )
    return ComparisonStudy(config, Study((scenario,), config.seed), no_control)


_RANKS = invented(
    "Ranks where none are set: 15 for the states, 10 for the actions or one less than there are of these, 9 for the "
    "episodes, 1 for the agents. The paper gives ranks for its own three problems only; its action ranks are these."
)


class _Side(NamedTuple):
    variant: Variant
    algorithm: AlgorithmConfig
    n_agents: int


def _check_numbers(config: ComparisonConfig, algorithms: tuple[Algorithm, Algorithm]) -> None:
    check_int("runs", config.n_runs, 1)
    check_int("episodes", config.n_episodes, 1)
    check_int("seed", config.seed, 0)
    if config.n_agents is not None:
        check_int("agents", config.n_agents, 1)
        if not any(algorithm.is_t_version for algorithm in algorithms):
            raise ParameterError(
                f"agents are those of a T-version, and neither {config.base} nor {config.candidate} is one: leave "
                "--agents out"
            )


def _settings_of_sides(
    config: ComparisonConfig, algorithms: tuple[Algorithm, Algorithm]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return each side's settings: those of both that it takes, under its own, which must be known to it."""
    of_both: dict[str, Any] = {}
    own: dict[str, dict[str, Any]] = {BASE: {}, CANDIDATE: {}}
    for name, value in config.settings.items():
        side, dot, parameter = name.rpartition(".")
        if not dot:
            check_setting(algorithms, name)
            of_both[name] = value
        elif side in own:
            check_setting((algorithms[list(own).index(side)],), parameter)
            own[side][parameter] = value
        else:
            raise UnknownNameError(
                f"unknown side {shown(side)} in {shown(name)}: {BASE}.{parameter} or {CANDIDATE}.{parameter} sets "
                f"one of the two, {parameter} both"
            )
    made = [
        {name: value for name, value in of_both.items() if name in parameters_of(algorithm)} | own[side]
        for algorithm, side in zip(algorithms, own, strict=True)
    ]
    return made[0], made[1]


def _side(config: ComparisonConfig, algorithm: Algorithm, settings: Mapping[str, Any], problem: partial[Any]) -> _Side:
    check_plays(algorithm, config.environment)
    parameters, of_step = split_settings(algorithm, settings)
    n_agents = (config.n_agents or 1) if algorithm.is_t_version else 1
    with bins_named():
        learner = algorithm.learner(problem(0), **parameters, n_agents=n_agents)
    sizes = (learner.problem.n_states, learner.problem.n_actions)
    step = tensor_step(algorithm, sizes, of_step)
    of_both = AlgorithmConfig(config.base, config.candidate, algorithm.learner, parameters, step, sizes[1])
    made = Variant(algorithm.name, algorithm.learner, parameters, n_agents, None)
    if algorithm.is_t_version:
        share = "" if step.share == algorithm.share else f"-{step.share}"
        made = replace(made, name=f"{algorithm.name}-{n_agents}{share}", tensor_step=step)
    return _Side(made, of_both, learner.n_agents)


def _with_two_names(base: Variant, candidate: Variant) -> tuple[Variant, Variant]:
    """Return both, with two names where they had one."""
    if base.specification() == candidate.specification():
        raise ParameterError(
            f"base and candidate are both {base.name} and would do the same: set something of one of them with "
            f"--set {CANDIDATE}.NAME=VALUE"
        )
    same = base.name == candidate.name
    return base, replace(candidate, name=f"{candidate.name}-{CANDIDATE}") if same else candidate


def _control(base: _Side, candidate: _Side) -> tuple[Variant | None, str]:
    """Return the constant control of the candidate, or else of the base, or why there is none."""
    side = candidate if candidate.variant.tensor_step else base
    step = side.variant.tensor_step
    if step is None:
        return None, "neither of the two has a tensor step whose smaller learning rate would have to be controlled for"
    if step.weights == "constant":
        return None, f"the weights of {side.variant.name} are constant: it is its own control"
    n_agents = side.variant.n_agents
    shared = f"-{step.share}" if side.n_agents > 1 and step.share != "none" else ""
    return variant(side.algorithm, f"constant-{n_agents}{shared}"), ""


def _label(name: str, keywords: Mapping[str, Any]) -> str:
    given = ", ".join(f"{key}={value!r}" for key, value in keywords.items())
    return f"{name}({given})" if given else name
