"""Expected SARSA, Double Q-learning, n-step SARSA, tree backup and Monte Carlo, each with its slow twin."""

from typing import Any

import numpy as np

from tests.learners.worlds import world_of
from tests.reference.double_q_learning import DoubleQLearner
from tests.reference.expected_sarsa import ExpectedSarsaLearner
from tests.reference.monte_carlo import MonteCarloLearner
from tests.reference.n_step_sarsa import NStepSarsaLearner
from tests.reference.q_learning import QLearner, Table
from tests.reference.rng import Stream
from tests.reference.tree_backup import TreeBackupLearner
from tuckerl import DoubleQLearning, ExpectedSarsa, MonteCarlo, NStepSarsa, TabularMDP, TreeBackup
from tuckerl.training.learner import Learner

VARIANTS: dict[str, tuple[type[Learner], dict[str, Any]]] = {
    "expected": (ExpectedSarsa, {}),
    "double": (DoubleQLearning, {}),
    "1-step": (NStepSarsa, {"n": 1}),
    "2-step": (NStepSarsa, {"n": 2}),
    "5-step": (NStepSarsa, {"n": 5}),
    "many-step": (NStepSarsa, {"n": 1000}),
    "tree 1": (TreeBackup, {"n": 1}),
    "tree 3": (TreeBackup, {"n": 3}),
    "tree of the policy": (TreeBackup, {"n": 4, "target": "policy"}),
    "first visits": (MonteCarlo, {"alpha": None}),
    "every visit": (MonteCarlo, {"alpha": None, "visits": "every"}),
    "first visits by alpha": (MonteCarlo, {}),
    "every visit by alpha": (MonteCarlo, {"visits": "every"}),
}
"""A class and what is given to it besides what all get."""

TWINS: dict[type[Learner], Any] = {
    ExpectedSarsa: ExpectedSarsaLearner,
    DoubleQLearning: DoubleQLearner,
    NStepSarsa: NStepSarsaLearner,
    TreeBackup: TreeBackupLearner,
    MonteCarlo: MonteCarloLearner,
}


def waiting_twin(
    made: type[Learner],
    mdp: TabularMDP,
    *,
    seed: int,
    agent: int = 0,
    alpha: float | None = 0.1,
    gamma: float = 0.95,
    epsilon: float = 0.1,
    epsilon_decay: float = 1.0,
    ties: str = "random",
    initial_q: float | Table = 0.0,
    **own: Any,
) -> QLearner:
    """The twin of ``made(mdp, ...)``'s agent."""
    if made is MonteCarlo:
        own["averages"] = alpha is None
    q = np.zeros((mdp.n_states, mdp.n_actions)) + initial_q
    twin: QLearner = TWINS[made](
        world_of(mdp), Stream(seed, agent), alpha, gamma, epsilon, epsilon_decay, ties, q, **own
    )
    return twin


def compare(
    made: type[Learner], problem: TabularMDP, episodes: int, *, n_agents: int = 1, seed: int = 5, **parameters: Any
) -> Learner:
    """Let a learner and its twins play the same, and return the learner."""
    learner = made(problem, seed=seed, n_agents=n_agents, **parameters).learn(episodes)
    for agent in range(n_agents):
        slow = waiting_twin(made, problem, seed=seed, agent=agent, **parameters)
        played = [slow.episode(np.ones(problem.n_actions)) for _ in range(episodes)]
        assert learner.steps[:, agent].tolist() == [steps for steps, _ in played]
        np.testing.assert_allclose(learner.returns[:, agent], [total for _, total in played], rtol=1e-9, atol=1e-9)
        assert learner.trajectories[agent].tolist() == slow.trajectory
        np.testing.assert_allclose(learner.q[agent], slow.q, rtol=1e-9, atol=1e-9)
    return learner
