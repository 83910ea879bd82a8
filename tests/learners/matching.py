"""Learners beside their slow twins: both play the same from the same stream, and must learn the same."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.learners.worlds import world_of
from tests.reference import tensor_step
from tests.reference.haql import HAQLearner
from tests.reference.q_learning import QLearner, Table
from tests.reference.r_learning import RLearner
from tests.reference.rng import Stream
from tests.reference.true_online_sarsa_lambda import TrueOnlineSarsaLambdaLearner
from tests.reference.watkins_q_lambda import WatkinsQLambdaLearner
from tests.training.test_resume import assert_same
from tuckerl import HAQL, RLearning, TabularMDP, TensorStep, TrueOnlineSarsaLambda, WatkinsQLambda
from tuckerl.training.learner import Learner

TWINS: dict[type[Learner], Any] = {
    WatkinsQLambda: WatkinsQLambdaLearner,
    TrueOnlineSarsaLambda: TrueOnlineSarsaLambdaLearner,
    RLearning: RLearner,
    HAQL: HAQLearner,
}


def twin_of(
    made: type[Learner],
    mdp: TabularMDP,
    *,
    seed: int,
    agent: int = 0,
    alpha: float = 0.1,
    gamma: float = 0.95,
    epsilon: float = 0.1,
    epsilon_decay: float = 1.0,
    ties: str = "random",
    initial_q: float | Table = 0.0,
    **own: Any,
) -> QLearner:
    """The twin of ``made(mdp, ...)``'s agent."""
    q = np.zeros((mdp.n_states, mdp.n_actions)) + initial_q
    if made is HAQL:
        own.setdefault("heuristic", mdp.heuristic)
    twin: QLearner = TWINS[made](
        world_of(mdp), Stream(seed, agent), alpha, gamma, epsilon, epsilon_decay, ties, q, **own
    )
    return twin


def assert_close(ours: Table, theirs: Table) -> None:
    """To 1e-9 of each entry, or of what rounding leaves where large changes cancel each other."""
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-14 * float(np.abs(theirs).max()) + 1e-290)


def compare(
    made: type[Learner], problem: TabularMDP, episodes: int, *, n_agents: int = 1, seed: int = 5, **parameters: Any
) -> tuple[Learner, list[Any]]:
    """Let a learner and its twins play, and return them."""
    learner = made(problem, seed=seed, n_agents=n_agents, **parameters).learn(episodes)
    twins = [twin_of(made, problem, seed=seed, agent=agent, **parameters) for agent in range(n_agents)]
    for agent, slow in enumerate(twins):
        played = [slow.episode(np.ones(problem.n_actions)) for _ in range(episodes)]
        assert learner.steps[:, agent].tolist() == [steps for steps, _ in played]
        np.testing.assert_allclose(learner.returns[:, agent], [total for _, total in played], rtol=1e-9, atol=1e-9)
        assert learner.trajectories[agent].tolist() == slow.trajectory
        assert_close(learner.q[agent], slow.q)
    return learner, twins


def compare_with_step(
    made: type[Learner], problem: TabularMDP, step: TensorStep, n_agents: int, **parameters: Any
) -> tuple[Learner, list[Any]]:
    """Let a learner with a tensor step and its twins play two windows and a bit, and return them."""
    parameters = {"alpha": 0.3, "epsilon": 1.0, "seed": 3} | parameters
    learner = made(problem, n_agents=n_agents, tensor_step=step, **parameters).learn(10)
    twins = [twin_of(made, problem, agent=agent, **parameters) for agent in range(n_agents)]
    assert isinstance(step.weights, str)
    assert isinstance(step.share, str)
    assert step.ranks is not None
    steps, windows = tensor_step.play(
        twins, 10, seed=3, every=4, ranks=step.ranks, weights=step.weights, sharing=step.share, floor=step.floor
    )
    assert step.every == 4
    assert learner.steps.tolist() == steps
    assert learner.tensor_step_history.chosen.tolist() == [window.chosen for window in windows]
    np.testing.assert_allclose(learner.action_weights, windows[-1].omega, rtol=0, atol=1e-9)
    for agent, slow in enumerate(twins):
        # The weights themselves agree to 1e-9 only: decompositions differ.
        np.testing.assert_allclose(learner.q[agent], slow.q, rtol=1e-8, atol=1e-9)
    return learner, twins


def goes_on_through_files(made: type[Learner], problem: TabularMDP, folder: Path, **parameters: Any) -> None:
    """Learning in pieces, through files and in memory, equals learning at once to the last bit; other seeds differ."""
    step = TensorStep(every=10, ranks=(4, 2, 3, 1), floor=0.1)
    common: dict[str, Any] = {"alpha": 0.3, "epsilon": 0.4, "epsilon_decay": 0.97} | parameters
    for n_agents, tensor_step_ in ((1, None), (3, step), (3, replace(step, share="mean"))):
        whole, parts, other = (
            made(problem, n_agents=n_agents, tensor_step=tensor_step_, seed=seed, **common) for seed in (6, 6, 7)
        )
        whole.learn(17)
        for piece in (3, 4, 10):
            parts.learn(piece).save(folder / "learner")
            parts = made.load(folder / "learner")
        assert_same(parts, whole)
        assert not np.array_equal(other.learn(17).q, whole.q)
        assert n_agents == 1 or whole.tensor_step_history.episode.tolist() == [10]
