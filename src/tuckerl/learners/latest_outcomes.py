"""A model that holds the latest outcome of each pair: what Dyna plans with, and prioritized sweeping.

Where one action can have several outcomes, what came last is planned with as if it were certain. (Sutton and Barto
2018, section 8.2.)
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tuckerl._jit import kernel
from tuckerl.errors import ImmutableError, SavedFileError
from tuckerl.generalization.change_log import ChangeLog, keep_row
from tuckerl.training.agent_arrays import Settings, Transition
from tuckerl.types import FloatArray

# The discount is 0 where the return ended. One record instead of three arrays: a planning step then finds its place in
# memory once, which is a third of its time.
OUTCOME = np.dtype([("reward", np.float64), ("discount", np.float64), ("next_state", np.uint32)], align=True)


@kernel
def keep_outcome(outcomes: NDArray[np.void], transition: Transition) -> None:
    """Put a transition into `outcomes`, (S, A) of `OUTCOME`, in place of the pair's last one."""
    outcome = outcomes[transition.state, transition.action]  # by name in brackets, so that it works uncompiled, too
    outcome["reward"], outcome["discount"] = transition.reward, transition.discount
    outcome["next_state"] = transition.next_state


@kernel
def list_state(model: Any, log: ChangeLog, state: int) -> None:
    """Append a state to the list of those observed, ``model.observed`` (S,) with its length in ``n_observed`` (1,)."""
    place = model.n_observed[0]
    keep_row(log, place)  # whose place in the list is another row than its own
    model.observed[place] = state
    model.n_observed[0] += 1


def check_outcomes(known: NDArray[np.void], n_states: int) -> None:
    """Refuse outcomes from a file, (K,) of `OUTCOME`, that no transition can have left.

    Raises
    ------
    SavedFileError
        If a next state is none, a reward is not finite or a discount is not one.
    """
    is_sound = (
        (known["next_state"] < n_states).all()
        and np.isfinite(known["reward"]).all()
        and ((known["discount"] >= 0.0) & (known["discount"] <= 1.0)).all()
    )
    if not is_sound:
        raise SavedFileError("the outcomes of a model must lead to states, with finite rewards and discounts up to 1")


def revised_discounts(discounts: FloatArray, before: Settings, now: Settings) -> FloatArray:
    """Return what becomes of the discounts of known outcomes, (...), where parameters were assigned.

    Raises
    ------
    ImmutableError
        If ends must be told from other steps, which a model with one discount for both cannot do.
    """
    is_told, must_be_told = (held.gamma != held.terminal_discount for held in (before, now))
    if must_be_told and not is_told and discounts.size:
        raise ImmutableError(
            f"gamma {now.gamma:g} cannot follow {before.gamma:g} without bootstrap_terminal: the models hold one "
            "discount for ends and for other steps, and cannot tell them apart; make a new learner"
        )
    revised: FloatArray = np.where(is_told & (discounts != before.gamma), now.terminal_discount, now.gamma)
    return revised
