"""Playing a run: a variant's learner learns on an instance of a scenario, and what came out goes into tables."""

import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from tuckerl.adapters.resolve import AdapterOptions, Environment, as_problem
from tuckerl.errors import (
    DecompositionWarning,
    DivergenceWarning,
    NoTableError,
    ProblemError,
    RankWarning,
    ZeroWeightWarning,
)
from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.studies.checkpoints import Spent, learned
from tuckerl.studies.runs import Run, is_recorded
from tuckerl.studies.study import Scenario, Study, Variant
from tuckerl.studies.tables import ROWS, StudyTables
from tuckerl.tensor import decompose
from tuckerl.training.learner import Learner
from tuckerl.training.regret import regret
from tuckerl.types import IntArray


@contextmanager
def _without_warnings() -> Iterator[None]:
    """Silence what the tables record anyway: clipped ranks, weights of 0, windows without factors, diverged runs."""
    with warnings.catch_warnings():
        for category in (RankWarning, ZeroWeightWarning, DecompositionWarning, DivergenceWarning):
            warnings.simplefilter("ignore", category)
        yield


def warm_up(study: Study) -> None:
    """Compile what the study needs, or fetch it from the cache on disk: play every kind of variant for a window.

    What fails here fails in the runs as well, one by one, where it is recorded.
    """
    if any(_decomposes(variant.tensor_step) for scenario in study.scenarios for variant in scenario.variants):
        _warm_up_decomposition()
    for scenario in study.scenarios:
        kinds = {(variant.learner, _decomposes(variant.tensor_step)): variant for variant in scenario.variants}
        for variant in kinds.values():
            with _without_warnings(), suppress(Exception):
                learner = variant.make(_environment(scenario, variant, 0), study.run_seed(scenario, 0, 0))
                learner.learn(episodes=1 if variant.tensor_step is None else variant.tensor_step.every)
                if variant.tensor_step is not None and not learner.q.any():  # so its window had nothing in it
                    values = np.random.default_rng(0).random(learner.q.shape[1:])
                    changed = replace(variant, parameters={**variant.parameters, "initial_q": values})
                    again = changed.make(_environment(scenario, variant, 0), study.run_seed(scenario, 0, 0))
                    again.learn(episodes=variant.tensor_step.every)


def _decomposes(step: TensorStep | None) -> bool | None:
    """Return whether a step decomposes its windows, which the constant control does not; None without a step."""
    return None if step is None else step.needs_decomposition


def _warm_up_decomposition() -> None:
    """Compile the routines of decompositions: few windows need them all."""
    tables = np.random.default_rng(0).random((40, 3, 4, 2))
    for tol in (0.0, 1.0):  # sweeps to the last; and a start whose fit is close enough, if a bound of it says so
        tuple(decompose(tables, (5, 2, 3, 1), tol, 2).factors)  # made when they are read


def _environment(scenario: Scenario, variant: Variant, instance: int) -> Environment:
    """Return what a variant's learner is to play."""
    options = variant.learner.adapter_options(variant.parameters)
    if options.bins is not None:  # not always hashable, and only needed where each learner makes its own
        return scenario.problem(instance)
    return _resolved(scenario.problem, instance, options)


@lru_cache(maxsize=64)
def _resolved(make: Callable[[int], Environment], instance: int, options: AdapterOptions) -> Environment:
    """Return the arrays or compiled functions, which all learners of a process share; or else the environment.

    An environment in Python has a state of its own, so each learner makes one for itself.
    """
    env = make(instance)
    problem = as_problem(env, options)
    return problem if problem.is_compiled else env


def play_run(study: Study, run: Run, checkpoint: Path | None = None) -> StudyTables:
    """Play a run and return what it leaves.

    Parameters
    ----------
    study : Study
    run : Run
    checkpoint : Path, optional
        Where a run that takes long keeps what it has, and from where it goes on, to the same bits. Deleting it when the
        run is stored is the caller's.
    """
    scenario = study.scenario(run.scenario)
    variant = scenario.variant(run.variant)
    environment, n_episodes = _environment(scenario, variant, run.instance), scenario.episodes_of(variant)
    seed = study.run_seed(scenario, run.instance, run.run)
    paths: list[list[IntArray]] = []
    before = time.process_time()  # kernels run in threads of their own
    with _without_warnings():
        if is_recorded(scenario, variant, run.instance, run.run):
            learner = variant.make(environment, seed)
            paths = _learn_with_paths(learner, n_episodes)
            spent = Spent(0.0, 0.0)
        else:
            make = partial(variant.make, environment, seed)
            learner, spent = learned(make, environment, n_episodes, checkpoint)
    seconds = time.process_time() - before
    return StudyTables(
        _runs_frame(learner, n_episodes),
        _weights_frame(learner),
        _paths_frame(paths),
        _frame(
            "times",
            agents=[variant.n_agents],
            seconds=[seconds + spent.seconds],
            tensor_step_seconds=[learner.tensor_step_seconds + spent.tensor_step_seconds],
            regret=[_regret(learner) if scenario.asks_regret else None],
        ),
    )


def _regret(learner: Learner) -> float | None:
    """Return the regret of what was learned; None where the transitions are not known, or no policy is best."""
    if learner.diverged_at is not None:
        return None
    try:
        return regret(learner).regret
    except (NoTableError, ProblemError):
        return None


def _learn_with_paths(learner: Learner, episodes: int) -> list[list[IntArray]]:
    """Learn as ever, and return the states of every episode, agent by agent."""
    paths = []
    for _ in range(episodes):
        learner.learn(episodes=1)
        if learner.diverged_at is not None:
            break
        paths.append(list(learner.trajectories))
    return paths


def _frame(kind: str, **columns: Any) -> pl.DataFrame:
    # Series by series: Polars takes longer to plan a selection than a short run takes.
    return pl.DataFrame([pl.Series(name, columns[name], dtype=dtype) for name, dtype in ROWS[kind].items()])


@cache
def _empty(kind: str) -> pl.DataFrame:
    """Return a table without rows; to make one takes as long as to make one with rows."""
    return pl.DataFrame(schema=ROWS[kind])


def _runs_frame(learner: Learner, n_episodes: int) -> pl.DataFrame:
    n_played = learner.episodes  # fewer where it diverged
    missing = ((0, 0), (0, n_episodes - n_played))
    agent, episode = np.indices((learner.n_agents, n_episodes)).reshape(2, -1)
    steps, returns = np.pad(learner.steps.T, missing).ravel(), np.pad(learner.returns.T, missing).ravel()
    columns = {"agent": agent, "episode": episode, "steps": steps, "return": returns}
    frame = _frame("runs", **columns, diverged=episode >= n_played)
    if n_played < n_episodes:
        frame = frame.with_columns(pl.when(~pl.col("diverged")).then(pl.col("steps", "return")))
    return frame


def _weights_frame(learner: Learner) -> pl.DataFrame:
    history = learner.tensor_step_history
    n_windows, n_actions = history.weights.shape
    if n_windows == 0:
        return _empty("weights")
    return _frame(
        "weights",
        episode=np.repeat(history.episode, n_actions),
        action=np.tile(np.arange(n_actions), n_windows),
        weight=history.weights.ravel(),
        chosen=np.repeat(history.chosen, n_actions),
        fit=np.repeat(history.fit, n_actions),
    )


def _paths_frame(paths: list[list[IntArray]]) -> pl.DataFrame:
    """Return the rows of paths by episode and agent, in the order of agents."""
    if not paths:
        return _empty("paths")
    rows = [
        (agent, episode, path)
        for agent in range(len(paths[0]))
        for episode, path in enumerate(by_agent[agent] for by_agent in paths)
    ]
    sizes = [path.size for _, _, path in rows]
    return _frame(
        "paths",
        agent=np.repeat([agent for agent, _, _ in rows], sizes),
        episode=np.repeat([episode for _, episode, _ in rows], sizes),
        step=np.concatenate([np.empty(0, np.int64), *map(np.arange, sizes)]),
        state=np.concatenate([np.empty(0, np.int64), *(path for _, _, path in rows)]),
    )
