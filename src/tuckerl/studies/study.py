"""A study as data: which variants of an algorithm play which scenarios, how often, from which seed.

A *scenario* has a problem for each of its *instances* (the maze's number), a list of *variants*, and what is made of
their runs: the claims that are tested, the ablation, the other readings, the figures. A run is a pure function of the
study and its (scenario, variant, instance, run), so nothing else, the number of workers least of all, can change a
result.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_int, shown
from tuckerl.errors import UnknownNameError
from tuckerl.generalization.sharing import SHARING_RULES
from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.generalization.weights import WEIGHTINGS
from tuckerl.studies.assumptions import Assumption
from tuckerl.studies.figure_text import FigureText
from tuckerl.training.learner import Learner
from tuckerl.training.parameter_json import in_words

FigureTextType = TypeVar("FigureTextType", bound=FigureText)


@dataclass(frozen=True)
class AlgorithmConfig:
    """The base algorithm of a scenario, its T-version, and the parameters that all its variants share."""

    base: str  # as on the command line: "dyna-h"
    t_version: str  # "dyna-ht"
    learner: type[Learner]
    parameters: Mapping[str, Any]
    step: TensorStep  # of the T-version, with the paper's share
    n_actions: int


@dataclass(frozen=True)
class Variant:
    """A learner of a study: its class, its parameters and its number of agents."""

    name: str
    learner: type[Learner]
    parameters: Mapping[str, Any]
    n_agents: int
    tensor_step: TensorStep | None
    n_episodes: int | None = None  # of each agent, where they are others than the scenario's

    def make(self, env: Environment, seed: np.random.SeedSequence) -> Learner:
        """Return the learner, ready to learn."""
        return self.learner(env, **self.parameters, n_agents=self.n_agents, tensor_step=self.tensor_step, seed=seed)

    def specification(self) -> dict[str, Any]:
        """Return all that decides what it does, as JSON."""
        step = None if self.tensor_step is None else as_entries(self.tensor_step)
        return {
            "learner": self.learner.__name__,
            "parameters": {name: in_words(value) for name, value in self.parameters.items()},
            "n_agents": self.n_agents,
            "tensor_step": step,
            **({} if self.n_episodes is None else {"episodes": self.n_episodes}),
        }


def as_entries(step: TensorStep) -> dict[str, Any]:
    """Return a tensor step's parameters as JSON; those that older studies did not know only where they are set."""
    entries = {name: value for name, value in vars(step).items() if value or name not in ("shrink", "share_every")}
    ranks = step.ranks
    return entries | {"ranks": ranks if ranks is None or isinstance(ranks, (str, float)) else list(ranks)}


def variant(algorithm: AlgorithmConfig, name: str) -> Variant:
    """Return the variant of an algorithm that `name` stands for.

    ``<base>``; ``<t-version>-<n>`` for n agents with the paper's share and ``<t-version>-<n>-<share>`` with another;
    ``<weights>-<n>`` for other weights without sharing and ``<weights>-<n>-<share>`` with it.

    Raises
    ------
    UnknownNameError
        If `name` follows none of these.
    """
    if name == algorithm.base:
        return Variant(name, algorithm.learner, algorithm.parameters, 1, None)
    match = re.fullmatch(r"(?P<kind>.+?)-(?P<n>[1-9]\d*)(?:-(?P<share>[a-z]+))?", name)
    kind = match["kind"] if match else ""
    if match is None or kind not in (algorithm.t_version, *WEIGHTINGS) or match["share"] not in (None, *SHARING_RULES):
        raise UnknownNameError(
            f"unknown variant {shown(name)}: expected {algorithm.base}, {algorithm.t_version}-<agents>[-<share>] or "
            f"<weights>-<agents>[-<share>] with weights {', '.join(WEIGHTINGS)} and share {', '.join(SHARING_RULES)}"
        )
    if kind == algorithm.t_version:
        step = replace(algorithm.step, share=match["share"] or algorithm.step.share)
    else:
        step = replace(algorithm.step, weights=kind, share=match["share"] or "none")
    return Variant(name, algorithm.learner, algorithm.parameters, int(match["n"]), step)


def variants(algorithm: AlgorithmConfig, *names: str) -> tuple[Variant, ...]:
    """Return the variants of an algorithm that the names stand for, each once."""
    return tuple(variant(algorithm, name) for name in dict.fromkeys(names))


@dataclass(frozen=True)
class Comparison:
    """A claim that one variant does better than another, with the control that has its learning rate only."""

    id: str
    claim: str
    measure: str  # a name in statistics.MEASURES
    base: str  # the names of variants
    candidate: str
    control: str  # "" for none
    # The base's own control, where base and candidate both have the tensor step and differ in how agents copy: then the
    # control says nothing of where the step's gain comes from, only whether its weights beat a constant rate.
    control_base: str = ""


@dataclass(frozen=True)
class Alternative:
    """Another reading of what a scenario's source leaves open: one thing changed."""

    label: str
    parameters: Mapping[str, Any] = field(default_factory=dict)  # of the learner
    step: Mapping[str, Any] = field(default_factory=dict)  # of the tensor step
    problem: Callable[[int], Environment] | None = None  # None: the scenario's own; so for the comparisons
    comparisons: tuple[Comparison, ...] | None = None


@dataclass(frozen=True)
class Scenario:
    """A problem, or several, what is compared on it, and how the results are shown.

    To add one, write a file with a `Scenario` in it and list it in :data:`tuckerl.studies.scenarios.SCENARIOS`.
    """

    name: str  # as on the command line
    title: str
    description: str  # one line for ``tuckerl list scenarios``
    number: int  # its place in the seeds; 0 to 3 are taken by the paper and ``tuckerl compare``
    problem: Callable[[int], Environment]  # from an instance's number
    n_instances: int
    n_runs: int
    n_episodes: int
    algorithm: AlgorithmConfig
    variants: tuple[Variant, ...]
    measure: str  # what curves and ablation show: a name in statistics.MEASURES
    comparisons: tuple[Comparison, ...] = ()
    assumptions: tuple[Assumption, ...] = ()
    record_paths_of: tuple[str, ...] = ()  # variants whose paths in run 0 of instance 0 are kept
    shares: tuple[str, ...] = ()  # the sharing rules of the ablation; none leaves several agents out of it
    alternatives: tuple[Alternative, ...] = ()  # to its readings, for ``--sensitivity``
    n_alternative_runs: int = 20  # of each alternative, at most
    figures: tuple[FigureText, ...] = ()  # what its figures say; those that it says nothing of are worded by default
    instance: str = "instance"  # what one is called
    asks_regret: bool = False  # whether the regret of what a run has learned is worked out, where it can be
    is_of_paper: bool = False  # whether the paper's claims about all of its scenarios are judged on it
    environment: Mapping[str, Any] = field(default_factory=dict)  # as JSON, where the scenario's name does not tell it
    module: str = ""  # in which that environment is written, whose code the runs execute

    @property
    def n_runs_of_each(self) -> int:
        """Number of runs of each variant, on all instances."""
        return self.n_instances * self.n_runs

    def variant(self, name: str) -> Variant:
        """Return the variant of this name."""
        return next(variant for variant in self.variants if variant.name == name)

    def episodes_of(self, variant: Variant) -> int:
        """Return how many episodes each agent of a variant plays."""
        return self.n_episodes if variant.n_episodes is None else variant.n_episodes

    def specification(self) -> dict[str, Any]:
        """Return all that decides the scenario's results, as JSON."""
        environment = {"environment": dict(self.environment)} if self.environment else {}
        return environment | {
            "instances": self.n_instances,
            "runs": self.n_runs,
            "episodes": self.n_episodes,
            "variants": {variant.name: variant.specification() for variant in self.variants},
        }

    def text_of(self, default: FigureTextType) -> FigureTextType:
        """Return what the scenario says of a figure of the default's kind, or else the default."""
        return next((text for text in self.figures if isinstance(text, type(default))), default)

    def resized(
        self, n_instances: int | None = None, n_runs: int | None = None, n_episodes: int | None = None
    ) -> "Scenario":
        """Return the scenario with other numbers where they are given.

        Raises
        ------
        ParameterError, ParameterTypeError
            If a number is not a whole number of at least 1.
        """
        return replace(
            self,
            n_instances=self.n_instances if n_instances is None else check_int("instances", n_instances, 1),
            n_runs=self.n_runs if n_runs is None else check_int("runs", n_runs, 1),
            n_episodes=self.n_episodes if n_episodes is None else check_int("episodes", n_episodes, 1),
        )


@dataclass(frozen=True)
class Study:
    """Scenarios and the seed of all their runs."""

    scenarios: tuple[Scenario, ...]
    seed: int

    def specification(self) -> dict[str, Any]:
        """Return all that decides the study's results, as JSON (versions of code aside)."""
        return {
            "seed": self.seed,
            "scenarios": {scenario.name: scenario.specification() for scenario in self.scenarios},
        }

    @property
    def n_runs(self) -> int:
        """Number of runs in all."""
        return sum(scenario.n_runs_of_each * len(scenario.variants) for scenario in self.scenarios)

    def scenario(self, name: str) -> Scenario:
        """Return the scenario of this name."""
        return next(scenario for scenario in self.scenarios if scenario.name == name)

    def run_seed(self, scenario: Scenario, instance: int, run: int) -> np.random.SeedSequence:
        """Return the seed of a run: equal for all variants, which pairs them."""
        return np.random.SeedSequence(self.seed, spawn_key=(scenario.number, instance, run))
