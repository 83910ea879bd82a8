"""Variants of algorithms on environments by name, and the constant controls of those with a tensor step.

A *control* is the same learner with as many agents and the same sharing, whose learning rate is as small as the tensor
step makes it on average, but equal for all actions.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

from tuckerl.adapters.resolve import Environment, as_problem
from tuckerl.studies.algorithms import ALGORITHMS, Algorithm, check_plays, split_settings, tensor_step
from tuckerl.studies.assumptions import invented
from tuckerl.studies.environments import bins_named, environment_module, maker
from tuckerl.studies.study import AlgorithmConfig, Comparison, Scenario, Variant
from tuckerl.training.learner import Learner

DEFAULT_RANKS = invented(
    "Ranks where none are set: 15 for the states, 10 for the actions or one less than there are of these, 9 for the "
    "episodes, 1 for the agents. The paper gives ranks for its own three problems only; its action ranks are these."
)


class NamedEnvironment:
    """An environment by its id and keywords, made once for all learners that can share it.

    Parameters
    ----------
    name : str
    keywords : mapping
        Of the environment.
    varied : str
        The keyword that has the instance's number; "" where all instances are the same.

    Raises
    ------
    UnknownNameError
        If there is no such environment.
    ProblemError
        If it cannot be made so.
    """

    def __init__(self, name: str, keywords: Mapping[str, Any], varied: str = "") -> None:
        self.name, self.keywords, self.varied = name, dict(keywords), varied
        self.problem = partial(maker, name=name, keywords=self.keywords, varied=varied)
        self.problem(0)().close()
        self._shared: dict[str, Environment] = {}

    @property
    def label(self) -> str:
        """The id with the keywords, if there are any."""
        return label(self.name, self.keywords)

    @property
    def specification(self) -> dict[str, Any]:
        """What decides which problem it is, as JSON."""
        varied = {"varied": self.varied} if self.varied else {}
        return {"id": self.name, "keywords": dict(self.keywords)} | varied

    def for_learner(self, learner: type[Learner], parameters: Mapping[str, Any]) -> Environment:
        """Return what a learner is made with: the compiled problem that all share, or else what makes it one."""
        options = learner.adapter_options(parameters)
        if options.bins is not None:  # what the bins are, each learner says itself
            return self.problem(0)
        key = repr(options)
        if key not in self._shared:
            problem = as_problem(self.problem(0), options)
            self._shared[key] = problem if problem.is_compiled else self.problem(0)
        return self._shared[key]


def label(name: str, keywords: Mapping[str, Any]) -> str:
    """Return an environment's id with its keywords, if there are any."""
    given = ", ".join(f"{key}={value!r}" for key, value in keywords.items())
    return f"{name}({given})" if given else name


class MadeVariant(NamedTuple):
    """A variant of which one learner has been made, so that nothing of it is impossible."""

    variant: Variant
    algorithm: AlgorithmConfig
    n_agents: int  # those of the learner: where agents share an environment, it says how many there are
    has_default_ranks: bool

    def named(self, name: str) -> "MadeVariant":
        """Return the same under another name."""
        return self._replace(variant=replace(self.variant, name=name))


def made_variant(
    algorithm: Algorithm, settings: Mapping[str, Any], n_agents: int, environment: NamedEnvironment, *bins: str
) -> MadeVariant:
    """Return an algorithm with its settings as a variant, named as the algorithm; its learner has been made once.

    Parameters
    ----------
    algorithm : Algorithm
    settings : mapping
        By the name of a parameter, of the learner or of the tensor step.
    n_agents : int
    environment : NamedEnvironment
    *bins : str
        How its user gives the bins that an environment lacks, where that is not a command's way.

    Raises
    ------
    ParameterError, ParameterTypeError, UnknownNameError
        If a setting is impossible or not known.
    ProblemError
        If the algorithm cannot play the environment.
    """
    check_plays(algorithm, environment.name)
    parameters, _ = split_settings(algorithm, settings)
    with bins_named(environment.name, *bins):
        env = environment.for_learner(algorithm.learner, parameters)
        learner = algorithm.learner(env, **parameters, n_agents=n_agents)
    sizes = (learner.problem.n_states, learner.problem.n_actions)
    return unmade_variant(algorithm, settings, n_agents, sizes)._replace(n_agents=learner.n_agents)


def unmade_variant(
    algorithm: Algorithm, settings: Mapping[str, Any], n_agents: int, sizes: tuple[int, int]
) -> MadeVariant:
    """Return what `made_variant` does for a problem of these sizes (S, A), but without having made a learner."""
    parameters, of_step = split_settings(algorithm, settings)
    step = tensor_step(algorithm, sizes, of_step)
    config = AlgorithmConfig(algorithm.name, algorithm.name, algorithm.learner, parameters, step, sizes[1])
    made = Variant(algorithm.name, algorithm.learner, parameters, n_agents, step if algorithm.is_t_version else None)
    return MadeVariant(made, config, n_agents, algorithm.is_t_version and "ranks" not in of_step)


def control_of(base: MadeVariant, candidate: MadeVariant) -> Variant | None:
    """Return the constant control of the candidate, or else of the base, under its name; None where there is none."""
    if why_no_control(base.variant, candidate.variant):
        return None
    side = candidate if candidate.variant.tensor_step else base
    step = side.variant.tensor_step
    if step is None:
        raise RuntimeError("a variant without a tensor step was to have a control")
    share = step.share if side.n_agents > 1 else "none"
    return replace(side.variant, tensor_step=replace(step, weights="constant", share=share))


def why_no_control(base: Variant, candidate: Variant) -> str:
    """Return why a comparison has no control; "" where it has one."""
    side = candidate if candidate.tensor_step else base
    if side.tensor_step is None:
        return "neither of the two has a tensor step whose smaller learning rate would have to be controlled for"
    return f"the weights of {side.name} are constant: it is its own control" if _is_constant(side) else ""


def _is_constant(variant: Variant) -> bool:
    return variant.tensor_step is not None and variant.tensor_step.weights == "constant"


def algorithm_of(variant: Variant) -> Algorithm:
    """Return the algorithm that a variant plays; of a control, that whose control it is."""
    is_t_version = variant.tensor_step is not None
    return next(
        one for one in ALGORITHMS.values() if one.learner is variant.learner and one.is_t_version == is_t_version
    )


def scenario_of(
    environment: NamedEnvironment,
    variants: list[MadeVariant],
    controls: list[Variant],
    comparisons: tuple[Comparison, ...],
    **numbers: Any,
) -> Scenario:
    """Return the scenario of variants on an environment; `numbers` are the fields that are left."""
    of_scenario = next((one for one in variants if one.variant.tensor_step), variants[0]).algorithm
    named: dict[str, Any] = {"title": environment.label, "description": "", "n_instances": 1}
    return Scenario(
        **named | numbers,
        problem=environment.problem,
        algorithm=of_scenario,
        variants=(*(one.variant for one in variants), *controls),
        comparisons=comparisons,
        assumptions=(DEFAULT_RANKS,) if any(one.has_default_ranks for one in variants) else (),
        environment=environment.specification,
        module=environment_module(environment.name),
    )
