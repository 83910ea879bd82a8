"""What solving reads of a problem: expected rewards, transition probabilities, and where actions may be taken.

The end of an episode is one more state, S, whose value is 0: an outcome that terminates leads there. So all
probabilities of a pair sum to 1, and no kernel asks whether something ended. A time limit is no end of the return and
is left out.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_array

from tuckerl.adapters.resolve import AdapterOptions, Agents, Environment, as_problem
from tuckerl.errors import NoTableError, ProblemError
from tuckerl.memory import Part, check_memory
from tuckerl.problems.mdp import MDPArrays, TabularMDP
from tuckerl.types import BoolArray, FloatArray, IntArray, StateArray

_UNKNOWN = (
    "only a problem whose transitions are known can be solved, and {}: make a tuckerl.TabularMDP of its transitions, "
    "or learn it"
)
_LARGEST = 1e290
_SMALLER = "solve a smaller problem"


class Model(NamedTuple):
    """A problem of S states, A actions and M outcomes, as kernels read it; pair (s, a) has the number s * A + a.

    Where every pair has one outcome, that of pair p is ``next_state[p]``, and `probability` and `offsets` are empty;
    otherwise its outcomes are ``offsets[p]`` up to ``offsets[p + 1]``.
    """

    reward: FloatArray  # (S * A,) expected
    next_state: StateArray  # (M,) of each outcome; S is the end
    probability: FloatArray  # (M,) or (0,)
    offsets: IntArray  # (S * A + 1,) or (0,)
    allowed: BoolArray  # (S, A) where an action may be taken, or (0, 0) where all may
    pays: BoolArray  # (S * A,) whether an outcome's reward is not 0
    stays: FloatArray  # (S * A,) probability of the pair's own state, or (0,) where every pair has one outcome
    n_states: int
    n_actions: int
    largest_reward: float  # the largest size of an outcome's

    @property
    def has_ends(self) -> bool:
        """Whether anything ends."""
        return bool((self.next_state == self.n_states).any())

    @property
    def n_outcomes(self) -> int:
        """How many outcomes a pair has at most."""
        return int(np.diff(self.offsets).max()) if self.offsets.size else 1

    @property
    def allowed_pairs(self) -> BoolArray:
        """Where an action may be taken, (S, A)."""
        shape = (self.n_states, self.n_actions)
        return self.allowed if self.allowed.size else np.ones(shape, dtype=np.bool_)

    def rounding(self, values: FloatArray) -> float:
        """Return how far rounding can move one update of a state's value, at most.

        It is that of a sum of as many products as a pair has outcomes (Higham, *Accuracy and Stability of Numerical
        Algorithms*, 2002, 3.1), of its expected reward, and of adding both.
        """
        size = self.largest_reward + float(np.abs(values).max(initial=0.0))
        return (self.n_outcomes + 3) * float(np.finfo(np.float64).eps) * size

    def transitions(self) -> csr_array:
        """Return the probability of each state after each pair, (S * A, S + 1) sparse; the last column is the end."""
        n_pairs = self.n_states * self.n_actions
        probability = self.probability if self.offsets.size else np.ones(n_pairs)
        offsets = self.offsets if self.offsets.size else np.arange(n_pairs + 1)
        parts = probability, self.next_state.astype(np.int64), offsets
        return csr_array(parts, shape=(n_pairs, self.n_states + 1))


def known_table(env: Environment) -> TabularMDP:
    """Return the table of transitions of a problem or environment.

    Parameters
    ----------
    env
        As learners take it. An environment of another class than Gymnasium's toy text and this library's own is
        believed its table ``P`` or ``mdp`` if some thousand random steps agree with it; of a PettingZoo environment,
        the joint table is meant, which pays the agents' mean reward.

    Raises
    ------
    NoTableError
        If there is no such table: it says what to do.
    TuckerlError
        If `env` is no environment, or its table has mistakes.
    """
    try:
        problem = as_problem(env, AdapterOptions(agents=Agents.JOINT, compiled=True))
    except NoTableError as error:
        raise NoTableError(_UNKNOWN.format(error.fact)) from error
    if isinstance(problem, TabularMDP):
        return problem
    raise NoTableError(_UNKNOWN.format(f"{problem} is played by code"))


def model_of(mdp: TabularMDP) -> Model:
    """Return what solving reads of an MDP.

    Raises
    ------
    TableSizeError
        If it would take more memory than is free.
    """
    arrays, n_pairs = mdp.arrays, mdp.n_states * mdp.n_actions
    outcomes = 4 + (8 + 3 * 8 if arrays.offsets.size else 0)
    check_memory(
        f"solving {mdp}",
        [
            Part("outcomes", arrays.outcomes.size * outcomes, _SMALLER),
            Part("rewards and values of pairs", n_pairs * (8 + 8 + 1), _SMALLER),
            Part("values of states", 4 * 8 * mdp.n_states, _SMALLER),
        ],
    )
    if mdp.n_states >= np.iinfo(np.uint32).max:  # the end needs a number, too
        raise ProblemError(f"solve numbers the end as one more state, for which {mdp} has too many")
    next_state = np.where(arrays.terminated, np.uint32(mdp.n_states), arrays.next_state)
    paid: Any = np.ascontiguousarray(arrays.reward)
    probability, reward, pays = np.zeros(0), paid, paid != 0
    if arrays.offsets.size:
        probability = _probabilities(arrays)
        first = arrays.offsets[:-1]
        reward = np.add.reduceat(probability * paid, first)
        pays = np.logical_or.reduceat(pays & (probability > 0), first)
    return sealed(
        reward=reward,
        next_state=next_state,
        probability=probability,
        offsets=arrays.offsets,
        allowed=arrays.action_mask,
        pays=pays,
        stays=_stays(mdp, next_state, probability),
        n_states=mdp.n_states,
        n_actions=mdp.n_actions,
        largest_reward=float(np.abs(paid).max()),
    )


def check_range(model: Model, gamma: float) -> None:
    """Refuse rewards whose discounted sum may leave the range of floats.

    Raises
    ------
    ProblemError
        If so.
    """
    size = model.largest_reward / (1.0 - gamma if gamma < 1.0 else 1e-20)
    if not size < _LARGEST:
        raise ProblemError(
            f"rewards of up to {model.largest_reward:g} with gamma={gamma!r} may sum to more than floats can hold: "
            "scale the rewards down"
        )


def sealed(**parts: Any) -> Model:
    """Return a model whose arrays are all read-only: kernels are compiled once for all models."""
    for name, part in parts.items():
        if isinstance(part, np.ndarray):
            parts[name] = part.view()
            parts[name].flags.writeable = False
    return Model(**parts)


def _stays(mdp: TabularMDP, next_state: StateArray, probability: FloatArray) -> FloatArray:
    """Return how probable each pair is to stay in its state, (S * A,); (0,) where every pair has one outcome."""
    if not probability.size:
        return probability
    offsets = mdp.arrays.offsets
    own = np.repeat(np.arange(offsets.size - 1) // mdp.n_actions, np.diff(offsets))
    stays: FloatArray = np.add.reduceat(np.where(next_state == own, probability, 0.0), offsets[:-1])
    return stays


def _probabilities(arrays: MDPArrays) -> FloatArray:
    """Return each outcome's probability, (M,), as kernels draw it: the last of a pair has what the others leave."""
    summed = np.minimum(arrays.cumulative, 1.0)
    summed[arrays.offsets[1:] - 1] = 1.0
    probability = np.diff(summed, prepend=0.0)
    probability[arrays.offsets[:-1]] = summed[arrays.offsets[:-1]]
    return probability
