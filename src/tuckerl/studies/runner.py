"""Running a study: every task is played by some worker, and yields tables of what came out.

A *task* is one run of one instance, played by all variants of its scenario. Workers are processes with one BLAS thread
each; with one worker everything happens in this process, also with one BLAS thread, so that all bits agree.
"""

import multiprocessing
import os
import signal
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import polars as pl
import scipy.linalg  # noqa: F401  # its BLAS must be loaded before it can be limited
from threadpoolctl import threadpool_limits

from tuckerl.adapters.resolve import AdapterOptions, Environment, as_problem
from tuckerl.errors import DecompositionWarning, DivergenceWarning, RankWarning, ZeroWeightWarning
from tuckerl.studies.study import Scenario, Study, Variant
from tuckerl.training.learner import Learner
from tuckerl.types import IntArray


class Task(NamedTuple):
    """One run of one instance of a scenario (by its place in the study)."""

    scenario: int
    instance: int
    run: int


class StudyTables(NamedTuple):
    """The tables that tasks produce, one for each kind of fact (columns in `SCHEMAS`)."""

    runs: pl.DataFrame  # steps and return of every episode; null from the one on in which a run diverged
    weights: pl.DataFrame  # what the tensor step decided after every window
    paths: pl.DataFrame  # the states of the recorded variants' shortest episodes
    times: (
        pl.DataFrame
    )  # processor time, and the tensor step's part of it: the one thing that differs between two runs of a study


_KEY: dict[str, Any] = {"scenario": pl.String, "variant": pl.String, "instance": pl.Int32, "run": pl.Int32}
_AGENT: dict[str, Any] = {"agent": pl.Int32}
SCHEMAS: dict[str, Any] = {
    "runs": _KEY | _AGENT | {"episode": pl.Int32, "steps": pl.Int64, "return": pl.Float64, "diverged": pl.Boolean},
    "weights": _KEY
    | {"episode": pl.Int32, "action": pl.Int32, "weight": pl.Float64, "chosen": pl.Int32, "fit": pl.Float64},
    "paths": _KEY | _AGENT | {"step": pl.Int32, "state": pl.Int64},
    "times": _KEY | {"agents": pl.Int32, "seconds": pl.Float64, "tensor_step_seconds": pl.Float64},
}


def all_tasks(study: Study) -> list[Task]:
    """Return the study's tasks in order."""
    return [
        Task(place, instance, run)
        for place, scenario in enumerate(study.scenarios)
        for instance in range(scenario.n_instances)
        for run in range(scenario.n_runs)
    ]


def play_tasks(study: Study, tasks: Sequence[Task], workers: int) -> Generator[tuple[Task, StudyTables], None, None]:
    """Play the tasks and yield each one's tables as it ends, in any order.

    Kernels are compiled here first, so that workers find them ready.
    """
    if not tasks:
        return
    with threadpool_limits(1):
        _warm_up(study)
        if workers == 1:
            for task in tasks:
                yield task, play_task(study, task)
            return
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(workers, len(tasks)), context, _start_worker, (study,))
    others = set(multiprocessing.active_children())
    try:
        with _interrupts_ignored():  # by the workers, which start here: Ctrl-C is this process's business
            futures = {pool.submit(_work, task): task for task in tasks}
        for future in as_completed(futures):
            yield futures.pop(future), future.result()
    finally:
        try:
            pool.shutdown(wait=True, cancel_futures=True)
        except KeyboardInterrupt:  # pressed again, while the tasks that had begun are played to their ends
            for worker in set(multiprocessing.active_children()) - others:
                worker.kill()
            raise


@contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """Ignore Ctrl-C here and in every process that is started meanwhile, for as long as that process lives."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread hears signals, and only it may say what becomes of them
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def play_task(study: Study, task: Task) -> StudyTables:
    """Play one run of one instance with every variant."""
    scenario = study.scenarios[task.scenario]
    played = [_play_variant(study, scenario, variant, task) for variant in scenario.variants]
    return StudyTables(*(pl.concat(frames) for frames in zip(*played, strict=True)))


_study: Study | None = None  # of this worker process


def _start_worker(study: Study) -> None:
    global _study
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _study = study
    threadpool_limits(1)
    _warm_up(study)  # or the first variant of the first task would pay for loading the kernels


def _end_with_parent() -> None:
    """End this worker when the process that started it has ended, however that was: nobody waits for its tasks."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _work(task: Task) -> StudyTables:
    if _study is None:
        raise RuntimeError("a worker was asked to work before it was started")
    return play_task(_study, task)


@contextmanager
def _without_warnings() -> Iterator[None]:
    """Silence what the tables record anyway: clipped ranks, weights of 0, windows without factors, diverged runs."""
    with warnings.catch_warnings():
        for category in (RankWarning, ZeroWeightWarning, DecompositionWarning, DivergenceWarning):
            warnings.simplefilter("ignore", category)
        yield


def _warm_up(study: Study) -> None:
    """Compile what the study needs, or fetch it from the cache on disk: play every kind of variant for a window."""
    for scenario in study.scenarios:
        kinds = {(variant.learner, variant.tensor_step is None): variant for variant in scenario.variants}
        for variant in kinds.values():
            learner = variant.make(_environment(scenario, variant, 0), study.run_seed(scenario, 0, 0))
            with _without_warnings():
                learner.learn(episodes=1 if variant.tensor_step is None else variant.tensor_step.every)


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


def _play_variant(study: Study, scenario: Scenario, variant: Variant, task: Task) -> StudyTables:
    is_recorded = variant.name in scenario.record_paths_of and (task.instance, task.run) == (0, 0)
    paths: list[IntArray] = []
    environment = _environment(scenario, variant, task.instance)
    before = time.process_time()  # kernels run in threads of their own
    learner = variant.make(environment, study.run_seed(scenario, task.instance, task.run))
    with _without_warnings():
        if is_recorded:
            paths = _learn_with_paths(learner, scenario.n_episodes)
        else:
            learner.learn(episodes=scenario.n_episodes)
    seconds = time.process_time() - before
    key = {"scenario": scenario.name, "variant": variant.name, "instance": task.instance, "run": task.run}
    return StudyTables(
        _runs_frame(key, learner, scenario.n_episodes),
        _weights_frame(key, learner),
        _paths_frame(key, paths),
        _frame(
            "times",
            key,
            agents=[variant.n_agents],
            seconds=[seconds],
            tensor_step_seconds=[learner.tensor_step_seconds],
        ),
    )


def _learn_with_paths(learner: Learner, episodes: int) -> list[IntArray]:
    """Learn as ever, and return the states of each agent's shortest episode (the first of them)."""
    best: list[IntArray] = []
    for _ in range(episodes):
        learner.learn(episodes=1)
        if learner.diverged_at is not None:
            break
        latest = learner.trajectories
        best = [min(pair, key=len) for pair in zip(best, latest, strict=True)] if best else list(latest)
    return best


def _frame(kind: str, key: dict[str, Any], **columns: Any) -> pl.DataFrame:
    data = pl.DataFrame(columns).with_columns(**{name: pl.lit(value) for name, value in key.items()})
    return data.select(*SCHEMAS[kind]).cast(SCHEMAS[kind])


def _runs_frame(key: dict[str, Any], learner: Learner, n_episodes: int) -> pl.DataFrame:
    agent, episode = np.indices((learner.n_agents, n_episodes)).reshape(2, -1)
    wanted = pl.DataFrame({"agent": agent, "episode": episode})
    played = wanted.join(learner.to_frame(), on=["agent", "episode"], how="left", maintain_order="left")
    return _frame("runs", key, **played.with_columns(diverged=pl.col("steps").is_null()).to_dict())


def _weights_frame(key: dict[str, Any], learner: Learner) -> pl.DataFrame:
    history = learner.tensor_step_history
    n_windows, n_actions = history.weights.shape
    return _frame(
        "weights",
        key,
        episode=np.repeat(history.episode, n_actions),
        action=np.tile(np.arange(n_actions), n_windows),
        weight=history.weights.ravel(),
        chosen=np.repeat(history.chosen, n_actions),
        fit=np.repeat(history.fit, n_actions),
    )


def _paths_frame(key: dict[str, Any], paths: list[IntArray]) -> pl.DataFrame:
    rows = [(agent, step, state) for agent, path in enumerate(paths) for step, state in enumerate(path.tolist())]
    return _frame("paths", key, **pl.DataFrame(rows, ("agent", "step", "state"), orient="row").to_dict())
