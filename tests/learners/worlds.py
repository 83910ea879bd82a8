"""Small worlds for the tests of learners, each as a compiled problem and as the twins read it."""

from functools import cache
from typing import Any, cast

import numpy as np

from tests.reference.dyna_h import DynaHLearner
from tests.reference.dyna_q import DynaQLearner, DynaQPlusLearner
from tests.reference.prioritized_sweeping import PrioritizedSweepingLearner
from tests.reference.q_learning import QLearner, Table, World
from tests.reference.r_max import RMaxLearner
from tests.reference.rng import Stream
from tests.reference.sarsa import SarsaLearner
from tests.reference.sarsa_lambda import SarsaLambdaLearner
from tests.reference.team_q import TeamQLearner
from tuckerl import Maze, Simulator, TabularMDP
from tuckerl.errors import MazeError
from tuckerl.generalization.change_log import empty_log
from tuckerl.rng import seed_sequence, stream, uniform
from tuckerl.training.agent_arrays import AgentArrays, EpisodeRecord, Settings
from tuckerl.training.policies.greedy import GreedyArrays
from tuckerl.training.row_maxima import NoMaxima
from tuckerl.types import FloatArray
from tuckerl.types import Stream as Words

UNLIMITED = 10**9


def world_of(mdp: TabularMDP) -> World:
    """Read a problem's arrays back into lists of outcomes."""
    arrays = mdp.arrays
    outcomes: list[list[list[tuple[float, int, float, bool]]]] = []
    for s in range(mdp.n_states):
        row = []
        for a in range(mdp.n_actions):
            pair = s * mdp.n_actions + a
            ks = range(arrays.offsets[pair], arrays.offsets[pair + 1]) if arrays.offsets.size else range(pair, pair + 1)
            summed = [float(arrays.cumulative[k]) for k in ks] if arrays.offsets.size else [1.0]
            row.append(
                [
                    (p, int(arrays.next_state[k]), float(arrays.reward[k]), bool(arrays.terminated[k]))
                    for k, p in zip(ks, np.diff([0.0, *summed]).tolist(), strict=True)
                ]
            )
        outcomes.append(row)
    starts = np.diff(np.concatenate([[0.0], arrays.start_cumulative])).tolist()
    start = [(p, int(s)) for p, s in zip(starts, arrays.start_state, strict=True)]
    return World(outcomes, start, mdp.max_episode_steps or UNLIMITED, arrays.action_mask.tolist())


class SimulatorWorld:
    """A simulator as the twins play it: its functions, interpreted, on the twin's own stream."""

    def __init__(self, simulator: Simulator) -> None:
        self.simulator, self.state = simulator, np.zeros(simulator.state_size)
        self.n_actions, self.limit = simulator.n_actions, simulator.max_episode_steps or UNLIMITED

    def allowed(self, state: int) -> list[int]:
        return list(range(self.n_actions))

    def first(self, stream: Stream) -> int:
        words = np.array(stream.words, dtype=np.uint64)
        self.simulator.functions.reset(self.simulator.parameters, self.state, words)
        stream.words = [int(word) for word in words]
        return self.simulator.functions.index(self.simulator.parameters, self.state)

    def step(self, state: int, action: int, stream: Stream) -> tuple[int, float, bool]:
        words = np.array(stream.words, dtype=np.uint64)
        reward, terminated = self.simulator.functions.step(self.simulator.parameters, self.state, action, words)
        stream.words = [int(word) for word in words]
        return self.simulator.functions.index(self.simulator.parameters, self.state), reward, terminated


def random_mdp(
    seed: int,
    n_states: int = 7,
    n_actions: int = 3,
    n_outcomes: int = 1,
    limit: int = 60,
    random_start: bool = False,
    ends: float = 0.08,
    action_sizes: tuple[int, ...] | None = None,
) -> TabularMDP:
    """A random problem whose ends are rare; with several outcomes, some of probability 0."""
    rng = np.random.default_rng(seed)
    shape = (n_states, n_actions) if n_outcomes == 1 else (n_states, n_actions, n_outcomes)
    probability = None
    if n_outcomes > 1:
        probability = rng.dirichlet(np.ones(n_outcomes), size=shape[:2])
        probability[0, 0] = np.eye(n_outcomes)[0]
    return TabularMDP(
        rng.integers(n_states, size=shape),
        rng.normal(size=shape),
        rng.random(shape) < ends,
        probability,
        start=rng.dirichlet(np.ones(n_states)) if random_start else 0,
        max_episode_steps=limit,
        heuristic=rng.integers(4, size=n_states).astype(np.float64),
        action_sizes=action_sizes,
    )


def agent_of(
    q: FloatArray,
    *,
    policy: Any = GreedyArrays(),  # noqa: B008  # it is immutable
    seed: int = 0,
    action_mask: Any = None,
    random_ties: bool = True,
) -> AgentArrays:
    """An agent as kernels read it, with a table and a policy and without an algorithm, an episode or a log."""
    none = np.zeros(0, dtype=np.int64)
    return AgentArrays(
        algorithm=None,
        policy=policy,
        q=q,
        weights=np.ones(q.shape[1]),
        step_sizes=np.zeros(q.shape[1]),
        scheduled=np.zeros(1),
        action_mask=np.zeros((0, 0), dtype=np.bool_)
        if action_mask is None
        else np.asarray(action_mask, dtype=np.bool_),
        settings=Settings(gamma=0.95, terminal_discount=0.0, random_ties=random_ties),
        maxima=NoMaxima(),
        log=empty_log(q.shape[0], q.shape[1], 0),
        record=EpisodeRecord(
            none, np.zeros(0), np.zeros((2, 1), np.int64), np.zeros((0, 1)), 0, 0, np.zeros(1, np.int64), 0
        ),
        rng=stream(seed_sequence(seed)),
        fault=np.zeros(4),
    )


def _drift_reset(parameters: FloatArray, state: FloatArray, rng: Words) -> None:
    state[0] = uniform(rng)
    state[1] = 0.0


def _drift_step(parameters: FloatArray, state: FloatArray, action: int, rng: Words) -> tuple[float, bool]:
    state[1] = 0.5 * state[1] + 0.25 * (action - 1) + parameters[0] * (uniform(rng) - 0.5)
    state[0] += state[1]
    return 0.25 - state[0] * state[0], abs(state[0]) > 1.5


def _drift_index(parameters: FloatArray, state: FloatArray) -> int:
    return min(int(abs(state[0]) * 4.0), 5) + (6 if state[1] > 0.0 else 0)


@cache  # its functions are compiled once for each
def drift(noise: float = 0.5, limit: int = 80) -> Simulator:
    """A place that drifts on a line; pushed left, not at all or right; leaving the middle part ends."""
    return Simulator(
        _drift_reset,
        _drift_step,
        _drift_index,
        n_states=12,
        n_actions=3,
        state_size=2,
        parameters=[noise],
        max_episode_steps=limit,
    )


def random_maze(seed: int, rows: int = 4, columns: int = 5) -> Maze:
    rng = np.random.default_rng(seed)
    while True:
        walls = rng.random((rows, columns)) < 0.2
        walls[0, 0] = walls[-1, -1] = False
        try:
            return Maze(walls, (0, 0), (rows - 1, columns - 1))
        except MazeError:
            continue


def corridor(length: int = 5, reward: float = -1.0, limit: int | None = 100) -> TabularMDP:
    """States 0 to length - 1 in a row; action 0 goes left, 1 right; leaving to the right ends."""
    states = np.arange(length)
    next_state = np.stack([np.maximum(states - 1, 0), np.minimum(states + 1, length - 1)], axis=1)
    ends = np.zeros((length, 2), dtype=np.bool_)
    ends[-1, 1] = True
    return TabularMDP(
        next_state,
        np.full((length, 2), reward),
        ends,
        max_episode_steps=limit,
        heuristic=(length - 1.0 - states),
    )


def twin(
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
) -> QLearner:
    """The Q-learning twin of ``QLearning(mdp, ...)``'s agent."""
    q = np.zeros((mdp.n_states, mdp.n_actions)) + initial_q
    return QLearner(world_of(mdp), Stream(seed, agent), alpha, gamma, epsilon, epsilon_decay, ties, q)


def dyna_twin(
    mdp: TabularMDP,
    *,
    seed: int,
    agent: int = 0,
    planning_steps: int = 10,
    search_control: str = "trajectory",
    farthest: bool = True,
    alpha: float = 0.1,
    gamma: float = 0.95,
    epsilon: float = 0.1,
    epsilon_decay: float = 1.0,
    ties: str = "random",
    initial_q: float | Table = 0.0,
) -> DynaHLearner:
    """The Dyna-H twin of ``DynaH(mdp, ...)``'s agent."""
    assert mdp.heuristic is not None
    return DynaHLearner(
        world_of(mdp),
        Stream(seed, agent),
        alpha,
        gamma,
        epsilon,
        epsilon_decay,
        ties,
        np.zeros((mdp.n_states, mdp.n_actions)) + initial_q,
        heuristic=mdp.heuristic,
        planning_steps=planning_steps,
        search_control=search_control,
        farthest=farthest,
    )


def _twin_world(problem: TabularMDP | Simulator) -> World:
    return world_of(problem) if isinstance(problem, TabularMDP) else cast(World, SimulatorWorld(problem))


def _common(
    problem: TabularMDP | Simulator,
    *,
    seed: int,
    agent: int = 0,
    alpha: float = 0.1,
    gamma: float = 0.95,
    epsilon: float = 0.1,
    epsilon_decay: float = 1.0,
    ties: str = "random",
    initial_q: float | Table = 0.0,
) -> tuple[Any, ...]:
    q = np.zeros((problem.n_states, problem.n_actions)) + initial_q
    return _twin_world(problem), Stream(seed, agent), alpha, gamma, epsilon, epsilon_decay, ties, q


def sarsa_twin(problem: TabularMDP | Simulator, *, bootstrap_terminal: bool = False, **settings: Any) -> SarsaLearner:
    """The twin of ``Sarsa(problem, ...)``'s agent."""
    return SarsaLearner(*_common(problem, **settings), bootstrap_terminal=bootstrap_terminal)


def sarsa_lambda_twin(
    problem: TabularMDP | Simulator,
    *,
    lambda_: float = 0.95,
    trace: str = "replacing",
    carry_trace: bool = False,
    bootstrap_terminal: bool = False,
    **settings: Any,
) -> SarsaLambdaLearner:
    """The twin of ``SarsaLambda(problem, ...)``'s agent."""
    return SarsaLambdaLearner(
        *_common(problem, **settings),
        lambda_=lambda_,
        trace=trace,
        carry_trace=carry_trace,
        bootstrap_terminal=bootstrap_terminal,
    )


def team_twin(
    problem: TabularMDP | Simulator,
    *,
    lambda_: float = 0.95,
    trace: str = "replacing",
    carry_trace: bool = False,
    bootstrap_terminal: bool = False,
    cut_traces: bool = True,
    exploration: str = "independent",
    **settings: Any,
) -> TeamQLearner:
    """The twin of ``TeamQ(problem, ...)``'s team."""
    sizes: tuple[int, ...] = (problem.n_actions,)
    if isinstance(problem, TabularMDP) and exploration == "independent":
        sizes = problem.action_sizes
    return TeamQLearner(
        *_common(problem, **settings),
        lambda_=lambda_,
        trace=trace,
        carry_trace=carry_trace,
        bootstrap_terminal=bootstrap_terminal,
        sizes=sizes,
        cut_traces=cut_traces,
    )


def dyna_q_twin(problem: TabularMDP | Simulator, *, planning_steps: int = 10, **settings: Any) -> DynaQLearner:
    """The twin of ``DynaQ(problem, ...)``'s agent."""
    return DynaQLearner(*_common(problem, **settings), planning_steps=planning_steps)


def dyna_q_plus_twin(
    problem: TabularMDP | Simulator, *, planning_steps: int = 10, kappa: float = 1e-3, **settings: Any
) -> DynaQPlusLearner:
    """The twin of ``DynaQPlus(problem, ...)``'s agent."""
    return DynaQPlusLearner(*_common(problem, **settings), planning_steps=planning_steps, kappa=kappa)


def prioritized_sweeping_twin(
    problem: TabularMDP | Simulator, *, planning_steps: int = 10, theta: float = 1e-4, **settings: Any
) -> PrioritizedSweepingLearner:
    """The twin of ``PrioritizedSweeping(problem, ...)``'s agent."""
    return PrioritizedSweepingLearner(*_common(problem, **settings), planning_steps=planning_steps, theta=theta)


def r_max_twin(problem: TabularMDP | Simulator, *, m: int = 10, tol: float = 0.0, **settings: Any) -> RMaxLearner:
    """The twin of ``RMax(problem, ...)``'s agent, which iterates until nothing moves."""
    return RMaxLearner(*_common(problem, **settings), m=m)
