"""Sweeps over all states, compiled: in place (Gauss-Seidel) and with what they changed (Jacobi).

A sweep in place uses each new value at once; sweeps go through the states forwards and backwards in turn, so that what
is known of a goal crosses a grid in a few sweeps, whichever way it lies.
"""

import numpy as np

from tuckerl._jit import kernel
from tuckerl.solving.model import Model
from tuckerl.types import BoolArray, FloatArray, IntArray


@kernel
def pair_value(model: Model, v: FloatArray, gamma: float, pair: int) -> float:
    """Return r(s, a) + gamma * sum over s' of p(s' | s, a) v(s').

    Parameters
    ----------
    model : Model
    v : (S + 1,) float64
        The last is the end's, 0.
    gamma : float
    pair : int
    """
    if model.offsets.size == 0:
        return model.reward[pair] + gamma * v[model.next_state[pair]]
    k, last = model.offsets[pair], model.offsets[pair + 1]
    one = two = three = four = 0.0
    while k + 4 <= last:  # four sums, as one would wait for itself at each addition
        one += model.probability[k] * v[model.next_state[k]]
        two += model.probability[k + 1] * v[model.next_state[k + 1]]
        three += model.probability[k + 2] * v[model.next_state[k + 2]]
        four += model.probability[k + 3] * v[model.next_state[k + 3]]
        k += 4
    while k < last:
        one += model.probability[k] * v[model.next_state[k]]
        k += 1
    return model.reward[pair] + gamma * (one + two + (three + four))


@kernel
def _best(model: Model, v: FloatArray, gamma: float, state: int) -> tuple[float, int]:
    """Return a state's largest pair value and the first action that has it; (-inf, -1) where none may be taken.

    Parameters
    ----------
    model : Model
    v : (S + 1,) float64
    gamma : float
    state : int
    """
    best, chosen = -np.inf, -1
    for action in range(model.n_actions):
        if model.allowed.size > 0 and not model.allowed[state, action]:
            continue
        value = pair_value(model, v, gamma, state * model.n_actions + action)
        if value > best:
            best, chosen = value, action
    return best, chosen


@kernel
def _settled_value(model: Model, v: FloatArray, gamma: float, state: int, pair: int) -> float:
    """Return what a pair would make of its state's value if it were taken until it leads elsewhere.

    So no state waits for itself. (A splitting of the equations: Puterman 2005, section 6.3.3.)

    Parameters
    ----------
    model : Model
    v : (S + 1,) float64
    gamma : float
    state, pair : int
    """
    value = pair_value(model, v, gamma, pair)
    stays = model.stays[pair] if model.offsets.size > 0 else 1.0 if model.next_state[pair] == state else 0.0
    again = gamma * stays
    return (value - again * v[state]) / (1.0 - again) if 0.0 < again < 1.0 else value


@kernel
def sweep(model: Model, v: FloatArray, gamma: float, policy: IntArray, first: int, n_sweeps: int) -> tuple[int, float]:
    """Give each state the largest value of its pairs, in place; return after how many sweeps, and the last change.

    Parameters
    ----------
    model : Model
    v : (S + 1,) float64
        Changed in place, but for the end's and those of states where no action may be taken.
    gamma : float
    policy : (S,) int64
        Changed in place: the actions that have these values.
    first : int
        Counts the sweeps: even ones go forwards.
    n_sweeps : int
        At most; one that changes nothing is the last.
    """
    change, done = 0.0, 0
    while done < n_sweeps:
        change = 0.0
        backwards = (first + done) % 2 == 1
        for i in range(model.n_states):
            state = model.n_states - 1 - i if backwards else i
            best = -np.inf
            for action in range(model.n_actions):
                if model.allowed.size == 0 or model.allowed[state, action]:
                    value = _settled_value(model, v, gamma, state, state * model.n_actions + action)
                    if value > best:
                        best, policy[state] = value, action
            if best > -np.inf:
                change = max(change, abs(best - v[state]))
                v[state] = best
        done += 1
        if change == 0.0:
            break
    return done, change


@kernel
def improve(
    model: Model, v: FloatArray, gamma: float, slack: float, policy: IntArray, better: FloatArray
) -> tuple[float, float, int]:
    """Write T v into `better` and a greedy policy into `policy`; return the least and largest of T v - v.

    The third number is how many states got another action.

    Parameters
    ----------
    model : Model
    v : (S + 1,) float64
    gamma : float
    slack : float
        By how much another action must be better than the policy's to take its place.
    policy : (S,) int64
        Changed in place; -1 where there is no action yet.
    better : (S + 1,) float64
        Changed in place.
    """
    low, high, changed = np.inf, -np.inf, 0
    for state in range(model.n_states):
        best, chosen = _best(model, v, gamma, state)
        if chosen < 0:
            better[state] = v[state]
            continue
        better[state] = best
        low, high = min(low, best - v[state]), max(high, best - v[state])
        old = policy[state]
        if old < 0 or (old != chosen and pair_value(model, v, gamma, state * model.n_actions + old) < best - slack):
            policy[state] = chosen
            changed += 1
    better[model.n_states] = 0.0
    return low, high, changed


@kernel
def follow(model: Model, policy: IntArray, v: FloatArray, gamma: float, n_sweeps: int) -> None:
    """Move `v` towards a policy's values, in place, by as many sweeps, forwards and backwards in turn.

    Parameters
    ----------
    model : Model
    policy : (S,) int64
        -1 where the value stays.
    v : (S + 1,) float64
        Changed in place.
    gamma : float
    n_sweeps : int
    """
    for number in range(n_sweeps):
        for i in range(model.n_states):
            state = model.n_states - 1 - i if number % 2 == 1 else i
            if policy[state] >= 0:
                pair = state * model.n_actions + policy[state]
                v[state] = _settled_value(model, v, gamma, state, pair)


@kernel
def follow_apart(model: Model, policy: IntArray, v: FloatArray, other: FloatArray, gamma: float, n_sweeps: int) -> None:
    """Move `v` towards a policy's values by twice as many sweeps, each apart from the values that it reads.

    Parameters
    ----------
    model : Model
    policy : (S,) int64
    v : (S + 1,) float64
        Changed.
    other : (S + 1,) float64
        Room.
    gamma : float
    n_sweeps : int
    """
    other[model.n_states] = 0.0
    for _ in range(n_sweeps):
        for state in range(model.n_states):
            other[state] = pair_value(model, v, gamma, state * model.n_actions + policy[state])
        for state in range(model.n_states):
            v[state] = pair_value(model, other, gamma, state * model.n_actions + policy[state])


@kernel
def write_action_values(
    model: Model, v: FloatArray, gamma: float, q: FloatArray, best: FloatArray, policy: IntArray
) -> None:
    """Write each pair's value into `q`, each state's largest into `best`, and the first action that has it.

    Where an action may not be taken, its value is minus infinity; where none may, the first action stands.

    Parameters
    ----------
    model : Model
    v : (S + 1,) float64
    gamma : float
    q : (S, A) float64
        Changed in place, as all that follow.
    best : (S,) float64
    policy : (S,) int64
    """
    for state in range(model.n_states):
        best[state], policy[state] = -np.inf, 0
        for action in range(model.n_actions):
            if model.allowed.size > 0 and not model.allowed[state, action]:
                q[state, action] = -np.inf
                continue
            value = pair_value(model, v, gamma, state * model.n_actions + action)
            q[state, action] = value
            if value > best[state]:
                best[state], policy[state] = value, action


@kernel
def spread(model: Model, usable: BoolArray, reached: BoolArray, policy: IntArray) -> None:
    """Reach all states from which usable pairs can lead to what is reached; note the first such action that is found.

    From a state that was reached here, the policy leads with some probability to one that was reached before it.

    Parameters
    ----------
    model : Model
    usable : (S, A) bool
    reached : (S + 1,) bool
        Changed in place.
    policy : (S,) int64
        Changed in place where a state is newly reached.
    """
    number, found = 0, 1
    while found > 0:
        found = 0
        for i in range(model.n_states):
            state = model.n_states - 1 - i if number % 2 == 1 else i
            if reached[state]:
                continue
            for action in range(model.n_actions):
                if usable[state, action] and may_lead_to(model, state * model.n_actions + action, reached):
                    reached[state] = True
                    policy[state] = action
                    found += 1
                    break
        number += 1


@kernel
def may_lead_to(model: Model, pair: int, states: BoolArray) -> bool:
    """Return whether an outcome of a pair leads to one of the states.

    Parameters
    ----------
    model : Model
    pair : int
    states : (S + 1,) bool
    """
    if model.offsets.size == 0:
        return states[model.next_state[pair]]
    for k in range(model.offsets[pair], model.offsets[pair + 1]):
        if model.probability[k] > 0.0 and states[model.next_state[k]]:
            return True
    return False


@kernel
def forbid(model: Model, usable: BoolArray, states: BoolArray) -> None:
    """Make all pairs unusable that may lead to one of the states, or begin there.

    Parameters
    ----------
    model : Model
    usable : (S, A) bool
        Changed in place.
    states : (S + 1,) bool
    """
    for state in range(model.n_states):
        for action in range(model.n_actions):
            if states[state] or may_lead_to(model, state * model.n_actions + action, states):
                usable[state, action] = False
