r"""R-max: what is not known well enough is taken to be as good as anything can be, and the rest is planned.

A pair is known once it was tried m times; its model is what came then. Every other pair is worth the most that there
can be, so that the greedy policy either does well or learns something new. Whenever a pair becomes known, the values of
all known pairs are computed by value iteration,

.. math:: Q(s, a) = \hat r(s, a) + \gamma \sum_{s'} \hat p(s' | s, a) \max_b Q(s', b)

(Brafman and Tennenholtz 2002; with pairs in the place of states, as in Strehl, Li and Littman 2009.)
"""

from collections.abc import Mapping
from typing import Any, NamedTuple, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tuckerl._jit import is_rare, kernel
from tuckerl.adapters.resolve import Environment, as_problem, check_compiled
from tuckerl.checks import check_int, check_real
from tuckerl.errors import ParameterError, ProblemError, SavedFileError
from tuckerl.generalization.change_log import ChangeLog, record_change
from tuckerl.learners.latest_outcomes import list_state
from tuckerl.problems.problem import Problem
from tuckerl.training.agent_arrays import AgentArrays, Transition, must_stop
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import Declaration, DeclaredArray
from tuckerl.training.greedy_actions import greedy_value
from tuckerl.training.learner import Learner
from tuckerl.training.parameters import LearnerParameters
from tuckerl.training.python_calls import PythonCallArrays, call_function
from tuckerl.training.row_maxima import change_value
from tuckerl.types import FloatArray, IntArray, StateArray

# One of the different outcomes of a pair; the discount is 0 where the return ended.
COUNTED = np.dtype([("discount", np.float64), ("next_state", np.uint32), ("count", np.uint32)], align=True)
_ROUNDING = 1e-14  # a sweep that moves no value by more of its size has moved none


class RMaxState(NamedTuple):
    """What R-max keeps for one agent: a model of what it has tried, and how to plan with it."""

    counted: NDArray[np.void]  # (S, A, m) of COUNTED: the different outcomes of each pair's first m trials
    n_counted: StateArray  # (S, A) how many different ones these are
    n_tried: StateArray  # (S, A) how often a pair was tried, up to m: then it is known
    paid: FloatArray  # (S, A) the sum of the rewards of these trials
    observed: StateArray  # (S,) the states in which an action was tried, in order
    n_observed: IntArray  # (1,)
    m: int
    tol: float  # planning ends with a sweep that moves no value by more
    r_max: float
    too_large: FloatArray  # (1,) a reward above r_max that was seen
    refuse: PythonCallArrays  # says so


@kernel
def count_outcome(model: RMaxState, log: ChangeLog, transition: Transition) -> None:
    """Add a transition to the model of a pair that is not known.

    Parameters
    ----------
    model : RMaxState
        Its arrays change at the transition's state and action; `observed`, (S,), grows by a state that is new.
    log : ChangeLog
        Where rows are kept that change; that of the transition's state is kept already.
    transition : Transition
    """
    state, action, reward, discount, next_state, _ = transition
    n_before = 0
    for other in range(model.n_tried.shape[1]):
        n_before += model.n_tried[state, other]
    if n_before == 0:
        list_state(model, log, state)
    model.n_tried[state, action] += 1
    model.paid[state, action] += reward
    for number in range(model.n_counted[state, action]):
        outcome = model.counted[state, action, number]
        if outcome["next_state"] == next_state and outcome["discount"] == discount:
            outcome["count"] += 1
            return
    outcome = model.counted[state, action, model.n_counted[state, action]]
    outcome["discount"], outcome["next_state"], outcome["count"] = discount, next_state, 1
    model.n_counted[state, action] += 1


@kernel
def expected(model: RMaxState, agent: AgentArrays, state: int, action: int) -> float:
    """Return what a known pair is worth by the model and the values of ``agent.q`` (S, A)."""
    total = model.paid[state, action]
    for number in range(model.n_counted[state, action]):
        outcome = model.counted[state, action, number]
        total += outcome["count"] * outcome["discount"] * greedy_value(agent, outcome["next_state"])
    return total / model.m


@kernel
def iterate_values(model: RMaxState, agent: AgentArrays) -> bool:
    """Compute the values of all known pairs, in place; the others in ``agent.q`` (S, A) stay as they are.

    Returns
    -------
    bool
        Whether all values are finite.
    """
    n_done, moved, size = 0, np.inf, 0.0
    while moved > model.tol + _ROUNDING * size:
        moved = size = 0.0
        for number in range(model.n_observed[0]):
            state = model.observed[number]
            n_done += 1
            if must_stop(agent.record, n_done):
                return True
            for action in range(agent.q.shape[1]):
                if model.n_tried[state, action] < model.m:
                    continue
                value = expected(model, agent, state, action)
                if not np.isfinite(value):
                    return False
                moved, size = max(moved, abs(value - agent.q[state, action])), max(size, abs(value))
                record_change(agent.log, state)
                change_value(agent, state, action, value)
    return True


@kernel
def update(algorithm: RMaxState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Count a step, and compute ``agent.q`` (S, A) anew if its pair becomes known."""
    state, action = transition.state, transition.action
    if is_rare(transition.reward > algorithm.r_max):
        algorithm.too_large[0] = transition.reward
        call_function(algorithm.refuse, state * agent.q.shape[1] + action)
        return False
    if algorithm.n_tried[state, action] == algorithm.m:
        return True
    record_change(agent.log, state)
    count_outcome(algorithm, agent.log, transition)
    if algorithm.n_tried[state, action] < algorithm.m:
        return True
    return iterate_values(algorithm, agent)


register_algorithm(RMaxState, update=update, keeps_maxima=True)


class RMax(Learner):
    """R-max for one agent or several, each with its own model and its own copy of the problem.

    Parameters
    ----------
    env
        As for every :class:`~tuckerl.training.learner.Learner`, whose other parameters hold too.
    r_max : float, optional
        A bound on rewards. Default: the largest one of the problem's transition table, where there is one.
    m : int
        How often a pair is tried until it is known.
    tol : float
        Value iteration ends with a sweep that moves no value by more.
    gamma : float in [0, 1)
        Discount: with 1, what is not known would be worth infinitely much.
    epsilon : float in [0, 1] or Schedule, optional
        Probability of a random action, 0 by default: R-max explores without.
    initial_q : float or (S, A) array, optional
        What pairs are worth that are not known. Default: the most that there can be, ``r_max / (1 - gamma)``; where
        r_max is negative r_max itself, as an episode may end at once.
    alpha
        Has no meaning: there is no step size.

    Raises
    ------
    ProblemError
        If rewards have no known bound, and `r_max` is not given.
    ParameterError
        If `r_max` is below a reward that the problem pays; by `learn`, where that is found out there.

    References
    ----------
    Brafman and Tennenholtz, *R-max*, JMLR 3, 2002; Strehl, Li and Littman, JMLR 10, 2009.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.RMax(tuckerl.sutton_maze(), m=1, seed=0).learn(episodes=50)
    >>> int(agent.steps[-1, 0])
    14
    """

    state_type = RMaxState
    fixed_parameters = (*Learner.fixed_parameters, "r_max", "m", "gamma", "bootstrap_terminal")

    def __init__(  # type: ignore[misc]  # initial_q is one of the parameters of all learners, where it may not be None
        self,
        env: Environment,
        *,
        r_max: float | None = None,
        m: int = 10,
        tol: float = 1e-6,
        initial_q: float | ArrayLike | None = None,
        **parameters: Unpack[LearnerParameters],
    ) -> None:
        self.m, self.tol = check_int("m", m, 1, np.iinfo(np.uint32).max), check_real("tol", tol, 0.0, low_open=True)
        gamma = _check_gamma(parameters.get("gamma", 0.95))
        if parameters.get("policy") is None and parameters.get("epsilon") is None:
            parameters["epsilon"] = 0.0
        check_compiled(parameters.get("compiled", "auto"))
        problem = as_problem(env, self.adapter_options(parameters))
        parameters.pop("bins", None)  # the problem has them, and is no environment that could be cut into bins again
        self.r_max = _bound(problem, r_max)
        first = _most(self.r_max, gamma) if initial_q is None else initial_q
        super().__init__(problem, initial_q=first, **parameters)
        self._too_large = np.zeros(1)
        # A table's rewards were looked at. Where Python is to be called, kernels return after each episode.
        call = None if problem.largest_reward is not None else self.call_from_kernels(self._refuse)
        self._refuse_arrays = PythonCallArrays(0, np.zeros(1, dtype=np.bool_)) if call is None else call.arrays

    def _refuse(self, pair: int) -> int:
        state, action = divmod(pair, self.problem.n_actions)
        raise ParameterError(
            f"r_max must be at least the largest reward; a step from state {state} by action {action} paid "
            f"{self._too_large[0]:g}, more than r_max={self.r_max:g}: make a new RMax with a larger r_max"
        )

    def declare_state(self) -> tuple[Declaration, ...]:
        """Return the model, which each agent keeps to itself."""
        tries = (0, self.m)
        return (
            DeclaredArray("model.counted", "none", ("states", "actions", self.m), COUNTED),
            DeclaredArray("model.n_counted", "none", dtype=np.uint32, bounds=tries),
            DeclaredArray("model.n_tried", "none", dtype=np.uint32, bounds=tries),
            DeclaredArray("model.paid", "none"),
            DeclaredArray("model.observed", "none", ("states",), np.uint32, bounds="states"),
            DeclaredArray("model.n_observed", "none", (1,), np.int64, bounds=(0, self.problem.n_states)),
        )

    def check_declared(self, declared: Mapping[str, Any]) -> None:
        """Refuse a model of a file whose parts contradict each other: planning uses them as indices."""
        n_tried, n = declared["model.n_tried"], int(declared["model.n_observed"][0])
        states = declared["model.observed"][:n]
        if np.unique(states).size < n or not np.array_equal(np.sort(states), np.flatnonzero(n_tried.any(axis=1))):
            raise SavedFileError("the observed states of a model must be those in which an action was tried, each once")
        tried = np.argwhere(n_tried)
        rows, n_counted = declared["model.counted"][tuple(tried.T)], declared["model.n_counted"]
        used = np.arange(self.m) < n_counted[tuple(tried.T)][:, None]
        counts = np.where(used, rows["count"], 0).sum(axis=1, dtype=np.int64)
        outcomes = rows[used]
        is_sound = (
            np.array_equal(counts, n_tried[tuple(tried.T)])
            and not n_counted[n_tried == 0].any()
            and (outcomes["count"] > 0).all()
            and (outcomes["next_state"] < self.problem.n_states).all()
            and ((outcomes["discount"] >= 0.0) & (outcomes["discount"] <= 1.0)).all()
            and np.isfinite(declared["model.paid"]).all()
        )
        if not is_sound:
            raise SavedFileError("the outcomes that a model counts must lead to states, and be as many as its trials")

    def why_no_weights(self) -> str:
        """Return that there is no step size."""
        return "R-max computes its table by value iteration and has no step size that weights could scale"

    def why_no_sharing(self) -> str:
        """Return that the table follows from the agent's own model."""
        return "R-max computes each agent's table anew from the agent's own model, so that what is shared would be lost"

    def constants(self) -> dict[str, Any]:
        """Return how to plan, and the bound on rewards."""
        own = {"too_large": self._too_large, "refuse": self._refuse_arrays}
        return {"m": self.m, "tol": self.tol, "r_max": self.r_max} | own


def _check_gamma(gamma: Any) -> float:
    gamma = check_real("gamma", gamma, 0.0, 1.0)
    if gamma == 1.0:
        raise ParameterError(
            "gamma must be below 1 in RMax, as what is not known would be worth infinitely much with 1: use 0.99, say"
        )
    return gamma


def _most(r_max: float, gamma: float) -> float:
    """Return the most that a pair can be worth; where rewards are negative, an episode may end at once."""
    most = max(r_max, r_max / (1.0 - gamma))
    if not np.isfinite(most):
        raise ParameterError(f"r_max / (1 - gamma) must be finite; got r_max={r_max:g} and gamma={gamma:g}")
    return most


def _bound(problem: Problem, r_max: object) -> float:
    """Return the bound on rewards that is given, or the problem's own."""
    largest = problem.largest_reward
    if r_max is None:
        if largest is None:
            raise ProblemError(
                "RMax needs a bound on rewards, and of this problem none is known: pass r_max=, the largest reward "
                "that a step can pay"
            )
        return largest
    bound = check_real("r_max", r_max)
    if largest is not None and bound < largest:
        raise ParameterError(
            f"r_max must be at least {largest:g}, the largest reward in the problem's transition table; got {bound:g}: "
            "leave it out, and that is taken"
        )
    return bound
