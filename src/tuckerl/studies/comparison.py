"""Comparing two algorithms on one environment, from the same seeds: the study behind ``tuckerl compare``.

Where one of the two is a T-version, the constant control is played as well: the same learner with as many agents and
the same sharing, whose learning rate is as small as the tensor step makes it on average, but equal for all actions.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from tuckerl.checks import check_int, check_name, shown
from tuckerl.errors import ParameterError, UnknownNameError
from tuckerl.studies.algorithms import Algorithm, check_setting, named_algorithm, parameters_of
from tuckerl.studies.study import Comparison, Scenario, Study, Variant
from tuckerl.studies.variants import (
    MadeVariant,
    NamedEnvironment,
    control_of,
    made_variant,
    scenario_of,
    why_no_control,
)

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
    equal_experience: bool = False  # whether `n_episodes` are those of all agents of a variant together


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
    environment = NamedEnvironment(config.environment, config.keywords)
    sides = (_side(config, *pair, environment) for pair in zip(algorithms, settings, strict=True))
    base, candidate = _with_two_names(*(_sharing_episodes(side, config) for side in sides))
    control = control_of(base, candidate)
    if control is not None:
        control = replace(control, name=_control_name(control, candidate if candidate.variant.tensor_step else base))
    names = base.variant.name, candidate.variant.name
    claim = f"{names[1]} does better than {names[0]}"
    scenario = scenario_of(
        environment,
        [base, candidate],
        [control] if control else [],
        (Comparison("", claim, config.measure, *names, control.name if control else ""),),
        name=environment.label,
        title=f"{algorithms[0].title} and {algorithms[1].title} on {environment.label}",
        number=SCENARIO_NUMBER,
        n_runs=config.n_runs,
        n_episodes=config.n_episodes,
        measure=config.measure,
        asks_regret=True,
    )
    return ComparisonStudy(config, Study((scenario,), config.seed), why_no_control(*scenario.variants[:2]))


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


def _side(
    config: ComparisonConfig, algorithm: Algorithm, settings: Mapping[str, Any], environment: NamedEnvironment
) -> MadeVariant:
    n_agents = (config.n_agents or 1) if algorithm.is_t_version else 1
    made = made_variant(algorithm, settings, n_agents, environment)
    step = made.variant.tensor_step
    if step is None:
        return made
    return made.named(f"{algorithm.name}-{n_agents}{'' if step.share == algorithm.share else f'-{step.share}'}")


def _sharing_episodes(side: MadeVariant, config: ComparisonConfig) -> MadeVariant:
    """Return a side whose agents share the episodes among them, where the comparison holds experience equal.

    Raises
    ------
    ParameterError
        If they cannot be shared equally.
    """
    n_agents = side.variant.n_agents
    if not config.equal_experience or n_agents == 1:
        return side
    own, rest = divmod(config.n_episodes, n_agents)
    if rest or not own:
        raise ParameterError(
            f"with equal experience, episodes must be a multiple of the {n_agents} agents that share them; got "
            f"{config.n_episodes}: give --episodes {(own + 1) * n_agents}"
        )
    return side._replace(variant=replace(side.variant, n_episodes=own))


def check_differ(base: Variant, candidate: Variant, advice: str) -> None:
    """Refuse two variants that would do the same.

    Raises
    ------
    ParameterError
        If that is so; it ends with the `advice`.
    """
    if base.specification() == candidate.specification():
        same = base.name == candidate.name
        names = f"both {base.name}" if same else f"{base.name} and {candidate.name}"
        raise ParameterError(f"base and candidate are {names} and would do the same: {advice}")


def _with_two_names(base: MadeVariant, candidate: MadeVariant) -> tuple[MadeVariant, MadeVariant]:
    """Return both, with two names where they had one."""
    advice = f"set something of one of them with --set {CANDIDATE}.NAME=VALUE"
    check_differ(base.variant, candidate.variant, advice)
    name = candidate.variant.name
    return base, candidate.named(f"{name}-{CANDIDATE}") if name == base.variant.name else candidate


def _control_name(control: Variant, side: MadeVariant) -> str:
    share = control.tensor_step.share if control.tensor_step else "none"
    return f"constant-{control.n_agents}{f'-{share}' if side.n_agents > 1 and share != 'none' else ''}"
