r"""Dyna-Q+: Dyna-Q for a world that changes, curious about what it has not tried for long.

In planning, a pair that was last tried tau real steps ago pays a bonus, so that long plans lead to where the world may
have changed:

.. math:: Q(s, a) \leftarrow Q(s, a) + \alpha\,\omega(a) [r + \kappa \sqrt{\tau} + \gamma \max_b Q(s', b) - Q(s, a)]

Actions that were never tried in an observed state are planned with, too, as if they led back to that state and paid
nothing but the bonus. (Sutton 1990; Sutton and Barto 2018, section 8.3.)
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple, Unpack

import numpy as np
from numpy.typing import NDArray

from tuckerl._jit import kernel
from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_real
from tuckerl.errors import SavedFileError
from tuckerl.generalization.change_log import record_change
from tuckerl.learners.dyna_q import DynaQ, known_pairs, remember
from tuckerl.learners.q_learning import move_towards_target
from tuckerl.rng import below
from tuckerl.training.agent_arrays import AgentArrays, Transition, must_stop
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import Declaration, DeclaredArray
from tuckerl.training.greedy_actions import random_action
from tuckerl.training.parameters import LearnerParameters
from tuckerl.types import IntArray, StateArray


class DynaQPlusState(NamedTuple):
    """What Dyna-Q+ keeps for one agent: Dyna-Q's model, and when each pair was last tried."""

    outcome: NDArray[np.void]  # (S, A) of OUTCOME
    tried: StateArray  # (S, A) the actions that were tried in each state, in order
    n_tried: StateArray  # (S,) how many these are
    observed: StateArray  # (S,) the states in which an action was tried, in order
    n_observed: IntArray  # (1,)
    last_tried: IntArray  # (S, A) in which real step, from 1; 0 where never
    clock: IntArray  # (1,) how many real steps there have been
    n_steps: int  # planned updates after each real step
    kappa: float


@kernel
def plan(model: DynaQPlusState, agent: AgentArrays) -> float:
    """Do the planning steps that follow a real one, which change ``agent.q`` (S, A).

    Returns
    -------
    float
        The sum of the new values: not finite if one of them is not.
    """
    total, rng = 0.0, agent.rng
    for number in range(model.n_steps):
        if must_stop(agent.record, number):
            break
        place: Any = np.uint32(below(model.n_observed[0], rng))  # unsigned: a tenth of the time
        state = model.observed[place]
        action: Any = np.uint32(random_action(agent, state))
        last = model.last_tried[state, action]
        reward, discount, next_state = 0.0, agent.settings.gamma, state
        if last > 0:
            outcome = model.outcome[state, action]
            reward, discount, next_state = outcome["reward"], outcome["discount"], outcome["next_state"]
        reward += model.kappa * math.sqrt(model.clock[0] - last)
        record_change(agent.log, state)
        total += move_towards_target(agent, state, action, reward, discount, next_state)
    return total


@kernel
def update(algorithm: DynaQPlusState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Learn from a step and plan: ``agent.q`` (S, A) and the model change."""
    state, action, reward, discount, next_state, _ = transition
    record_change(agent.log, state)
    value = move_towards_target(agent, state, action, reward, discount, next_state)
    remember(algorithm, agent.log, transition)
    algorithm.clock[0] += 1
    algorithm.last_tried[state, action] = algorithm.clock[0]
    return np.isfinite(value + plan(algorithm, agent))


register_algorithm(DynaQPlusState, update=update, keeps_maxima=True)


class DynaQPlus(DynaQ):
    """Dyna-Q+ for one agent or several, each with its own model and its own copy of the problem.

    Parameters
    ----------
    env
        As for every :class:`~tuckerl.training.learner.Learner`, whose other parameters hold too.
    planning_steps : int
        Planned updates after each real step.
    kappa : float
        What a planned pair pays for each square root of a step since it was last tried, in units of the reward.

    References
    ----------
    Sutton, *Integrated architectures for learning, planning, and reacting*, ICML 1990; Sutton and Barto, *Reinforcement
    Learning*, 2018, section 8.3.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.DynaQPlus(tuckerl.sutton_maze(), kappa=1e-4, seed=0).learn(episodes=50)
    >>> int(agent.steps.min())
    14
    """

    state_type = DynaQPlusState

    def __init__(self, env: Environment, *, kappa: float = 1e-3, **parameters: Unpack["_DynaQParameters"]) -> None:
        self.kappa = check_real("kappa", kappa, 0.0)
        super().__init__(env, **parameters)

    def declare_state(self) -> tuple[Declaration, ...]:
        """Return the model and its clock, which each agent keeps to itself."""
        most = float(2**62)
        return (
            *super().declare_state(),
            DeclaredArray("model.last_tried", "none", dtype=np.int64, bounds=(0, most)),
            DeclaredArray("model.clock", "none", (1,), np.int64, bounds=(0, most)),
        )

    def check_declared(self, declared: Mapping[str, Any]) -> None:
        """Refuse a model of a file whose parts contradict each other: planning uses them as indices."""
        super().check_declared(declared)
        last, clock = declared["model.last_tried"], declared["model.clock"][0]
        if not np.array_equal(last > 0, known_pairs(declared)) or last.max() != clock:
            raise SavedFileError("the pairs that a model knows must have been tried, the last one in its latest step")

    def constants(self) -> dict[str, Any]:
        """Return how much to plan, and the weight of the bonus."""
        return super().constants() | {"kappa": self.kappa}


class _DynaQParameters(LearnerParameters, total=False):
    planning_steps: int
