"""The tensor step line by line (Figures 5, 7 and 8): the whole MQT tensor, decomposed as it stands."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from tests.reference.q_learning import QLearner, Table
from tests.reference.sarsa_lambda import SarsaLambdaLearner
from tests.reference.tensor import leading_vectors, project, unfold

Ranks = Sequence[int] | float | str  # numbers, or the share of the squares that is to be explained; "auto" is 0.95
STEP_STREAM = 2**32 - 1


class Window(NamedTuple):
    """What the step did after one window."""

    omega: Table
    chosen: int
    ranks: tuple[int, ...]


def clipped(MQT: Table, ranks: Ranks) -> list[int]:
    """At most the numerical rank of each mode and the product of the other ranks."""
    allowed = []
    for mode in range(4):
        values = np.linalg.svd(unfold(MQT, mode), compute_uv=False)
        if isinstance(ranks, str):
            rank = carrying(values, 0.95)
        else:
            rank = carrying(values, ranks) if isinstance(ranks, float) else ranks[mode]
        allowed.append(min(rank, int((values > 1e-10 * values[0]).sum())))
    for _ in range(10):
        for mode in range(4):
            others = int(np.prod([rank for n, rank in enumerate(allowed) if n != mode]))
            allowed[mode] = min(allowed[mode], others)
    return allowed


def carrying(values: Any, share: float) -> int:
    """The least number of singular values whose squares are that share of all squares."""
    if share == 1.0:
        return len(values)
    rank, carried = 0, 0.0
    while carried < share * (1 - 1e-12) * sum(values**2):
        carried += values[rank] ** 2
        rank += 1
    return rank


def factors_of(MQT: Table, ranks: list[int], tol: float, max_iterations: int) -> list[Table]:
    """Tucker3 by alternating least squares from the truncated HOSVD."""
    factors = [leading_vectors(MQT, mode, rank) for mode, rank in enumerate(ranks)]

    def fit() -> float:
        explained = float(np.sum(project(MQT, factors) ** 2) / np.sum(MQT**2))
        return 1 - math.sqrt(max(0.0, 1 - explained))

    now = fit()
    for _ in range(max_iterations):
        for mode, rank in enumerate(ranks):
            factors[mode] = leading_vectors(project(MQT, factors, skip=mode), mode, rank)
        before, now = now, fit()
        if abs(now - before) < tol:
            break
    return factors


def row_norms(matrix: Table) -> Table:
    return np.array([np.sqrt(sum(x * x for x in row)) for row in matrix])


def weigh(kind: str, A_p: Table, rng: np.random.Generator) -> Table:
    paper: Table = row_norms(A_p) / np.sqrt((A_p**2).sum())
    if kind == "paper":
        return paper
    if kind == "relative":
        return np.asarray(paper / max(paper))
    if kind == "permuted":
        return np.array(rng.permutation(paper), dtype=np.float64)
    if kind == "constant":
        return np.array([1 / np.sqrt(len(paper))] * len(paper))
    return np.ones(len(paper))


def share(kind: str, Ag_p: Table, returns: Table, rng: np.random.Generator) -> list[float] | None:
    """How much of each agent's table goes into the common one."""
    n_agents = returns.shape[1]
    norms = row_norms(Ag_p)
    one_of = {
        "max": lambda: int(np.flatnonzero(norms > max(norms) - 1e-9)[0]),
        "min": lambda: int(np.flatnonzero(norms < min(norms) + 1e-9)[0]),
        "best": lambda: int(np.argmax([sum(column) for column in returns.T])),
        "random": lambda: int(rng.integers(n_agents)),
    }
    if kind in one_of:
        chosen = one_of[kind]()
        return [1.0 if agent == chosen else 0.0 for agent in range(n_agents)]
    if kind == "mean":
        return [1 / n_agents] * n_agents
    if kind == "consensus":
        return [float(norm / sum(norms)) for norm in norms]
    return None


def by_visits(tables: list[Table], changes: list[Table]) -> Table:
    """Entry by entry the mean weighted by who changed it in how many episodes; the plain mean where nobody did."""
    common = np.zeros(tables[0].shape)
    for s, a in np.ndindex(*common.shape):
        counts = [float(count[s, a]) for count in changes]
        if sum(counts) == 0:
            counts = [1.0] * len(tables)
        common[s, a] = sum(n * q[s, a] for n, q in zip(counts, tables, strict=True)) / sum(counts)
    return common


def share_traces(agents: Sequence[QLearner], mixture: Sequence[float]) -> None:
    """A copied agent's trace goes along with its table; a mixture of tables has none."""
    tracing = [agent for agent in agents if isinstance(agent, SarsaLambdaLearner)]
    if not tracing:
        return
    common = tracing[mixture.index(1.0)].e.copy() if 1.0 in mixture else np.zeros_like(tracing[0].e)
    for agent in tracing:
        agent.e = common.copy()


def shrunk(agents: Sequence[QLearner], MQT: Table, factors: list[Table], rows: set[int], part: float) -> None:
    """Draw the rows that the window changed to what the decomposition says of its last episode."""
    core = project(MQT, factors)
    S_p, A_p, E_p, Ag_p = factors
    for j, agent in enumerate(agents):
        said = np.einsum("abcd,sa,tb,c,d->st", core, S_p, A_p, E_p[-1], Ag_p[j])
        for s in rows:
            agent.q[s] = (1 - part) * agent.q[s] + part * said[s]


def play(
    agents: Sequence[QLearner],
    episodes: int,
    *,
    seed: int,
    every: int,
    ranks: Ranks,
    weights: str = "paper",
    sharing: str = "max",
    floor: float = 0.0,
    tol: float = 1e-4,
    max_iterations: int = 50,
    shrink: float = 0.0,
    share_every: int | None = None,
) -> tuple[list[list[int]], list[Window]]:
    """Figure 5, 7 or 8 from line 6 or 7 on; return the steps by episode and agent, and what the step did."""
    n_states, n_actions = agents[0].q.shape
    share_every = share_every or every
    omega = np.ones(n_actions)
    MQT = np.zeros((n_states, n_actions, every, len(agents)))
    rows: set[int] = set()  # that were updated since omega changed
    returns: list[list[float]] = []
    before = [agent.q.copy() for agent in agents]  # at the end of the latest episode
    changes = [np.zeros((n_states, n_actions)) for _ in agents]  # in how many episodes since tables were shared
    steps: list[list[int]] = []
    windows: list[Window] = []
    for i in range(1, episodes + 1):
        steps.append([0] * len(agents))
        returns.append([0.0] * len(agents))
        for j, agent in enumerate(agents):
            steps[-1][j], returns[-1][j] = agent.episode(omega)
            MQT[:, :, (i - 1) % every, j] = agent.q
            changes[j] += agent.q != before[j]
            before[j] = agent.q.copy()
            rows |= set(agent.trajectory[:-1])
        weighs, shares = i % every == 0, i % share_every == 0
        if not (weighs or shares):
            continue
        chosen, used = -1, [0, 0, 0, 0]
        if not weighs or MQT.any():
            rng = np.random.default_rng(
                np.random.SeedSequence(seed, spawn_key=(STEP_STREAM, i // min(every, share_every)))
            )
            factors = [np.ones((1, 1))] * 4
            if weighs:
                used = clipped(MQT, ranks)
                factors = factors_of(MQT, used, tol, max_iterations)
                omega = np.array([max(w, floor) for w in weigh(weights, factors[1], rng)])
            if shares:
                mixture = share(sharing, factors[3], np.array(returns[-share_every:]), rng)
                chosen = shared(agents, sharing, mixture, changes)
            if shares and shrink > 0:
                shrunk(agents, MQT, factors, rows, shrink)
        windows.append(Window(omega, chosen, tuple(used)))
        if shares:
            before = [agent.q.copy() for agent in agents]
            changes = [np.zeros((n_states, n_actions)) for _ in agents]
        if weighs:
            rows = set()
    return steps, windows


def shared(agents: Sequence[QLearner], sharing: str, mixture: list[float] | None, changes: list[Table]) -> int:
    """Let all agents go on with one table, and return whose it is, -1 if it is nobody's."""
    if sharing == "visits":
        common = by_visits([agent.q for agent in agents], changes)
        mixture = []  # of nobody's whole table
    elif mixture is None:
        return -1
    else:
        common = np.array(sum(part * agent.q for part, agent in zip(mixture, agents, strict=True)))
    for agent in agents:
        agent.q = common.copy()
    share_traces(agents, mixture)
    return mixture.index(1.0) if 1.0 in mixture else -1
