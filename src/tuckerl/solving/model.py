"""What solving reads of a problem: expected rewards, transition probabilities, and where actions may be taken.

The end of an episode is one more state, S, whose value is 0: an outcome that terminates leads there. So all
probabilities of a pair sum to 1, and no kernel asks whether something ended. A time limit is no end of the return and
is left out.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_array

from tuckerl._jit import kernel
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
_UNASKED = 2**25  # bytes
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
    n_outcomes: int  # that a pair has at most
    has_ends: bool  # whether anything ends

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
    per_outcome = 12 if arrays.offsets.size else 4
    needed = [
        Part("outcomes", arrays.outcomes.size * per_outcome, _SMALLER),
        Part("rewards and values of pairs", n_pairs * (8 + 1 + 8 + 8), _SMALLER),
        Part("values of states", 6 * 8 * mdp.n_states, _SMALLER),
    ]
    if sum(part.n_bytes for part in needed) > _UNASKED:  # to read what is free takes as long as solving a small problem
        check_memory(f"solving {mdp}", needed)
    if mdp.n_states >= np.iinfo(np.uint32).max:  # the end needs a number, too
        raise ProblemError(f"solve numbers the end as one more state, for which {mdp} has too many")
    n_outcomes, is_certain = arrays.outcomes.size, not arrays.offsets.size
    several = (0, 0) if is_certain else (n_outcomes, n_pairs)
    parts: dict[str, Any] = {
        "next_state": np.empty(n_outcomes, dtype=np.uint32),
        "probability": np.empty(several[0]),
        "reward": np.empty(n_pairs),
        "pays": np.empty(n_pairs, dtype=np.bool_),
        "stays": np.empty(several[1]),
    }
    largest, most, has_ends = read_outcomes(arrays, mdp.n_states, *parts.values())
    return sealed(
        **parts,
        offsets=arrays.offsets,
        allowed=arrays.action_mask,
        n_states=mdp.n_states,
        n_actions=mdp.n_actions,
        largest_reward=largest,
        n_outcomes=most,
        has_ends=has_ends,
    )


@kernel
def read_outcomes(
    arrays: MDPArrays,
    n_states: int,
    next_state: StateArray,
    probability: FloatArray,
    reward: FloatArray,
    pays: BoolArray,
    stays: FloatArray,
) -> tuple[float, int, bool]:
    """Write what a model holds of an MDP's outcomes; return the largest reward, the most outcomes, whether any ends.

    Of a pair's outcomes, the last has the probability that the others leave, as kernels draw it.

    Parameters
    ----------
    arrays : MDPArrays
    n_states : int
    next_state : (M,) uint32
        Written, as all that follow.
    probability : (M,) or (0,) float64
    reward : (S * A,) float64
    pays : (S * A,) bool
    stays : (S * A,) or (0,) float64
    """
    largest, most, has_ends = 0.0, 1, False
    for pair in range(reward.size):
        first, last = pair, pair + 1
        if arrays.offsets.size > 0:
            first, last = arrays.offsets[pair], arrays.offsets[pair + 1]
        most, summed, mean, stay, does_pay = max(most, last - first), 0.0, 0.0, 0.0, False
        state = pair // arrays.n_actions
        for k in range(first, last):
            outcome = arrays.outcomes[k]
            following, paid = outcome["next_state"], outcome["reward"]
            if outcome["terminated"]:
                following, has_ends = n_states, True
            upto = 1.0 if k == last - 1 else min(arrays.cumulative[k], 1.0)
            p, summed = upto - summed, upto
            if probability.size > 0:
                probability[k] = p
            next_state[k], mean = following, mean + p * paid
            largest, does_pay = max(largest, abs(paid)), does_pay or (p > 0.0 and paid != 0.0)
            if following == state:
                stay += p
        reward[pair], pays[pair] = mean, does_pay
        if stays.size > 0:
            stays[pair] = stay
    return largest, most, has_ends


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
