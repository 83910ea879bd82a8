"""Checks of what is learned: that it is right, finite and allowed, and that every change is recorded."""

from typing import Any

import numpy as np

from tuckerl.errors import LearnerCheckError, ParameterError
from tuckerl.generalization.change_log import EPISODES
from tuckerl.testing.small_problems import FORBIDDEN_VALUE, LENGTH, drift, masked, one_step, overflowing, slippery
from tuckerl.testing.subject import EVERY, Subject
from tuckerl.training.declared_state import DeclaredArray
from tuckerl.training.learner import Learner

_GAMMA = 0.9


def check_corridor(subject: Subject) -> None:
    """Check that the way to the end of a corridor is learned, and the tables stay finite."""
    learner = subject.on_corridor().learn(300)
    if learner.q.shape != (1, LENGTH, 2) or not np.isfinite(learner.q).all():
        raise LearnerCheckError(f"the tables of {subject.name} must be finite; in a corridor they became {learner.q}")
    actions, _ = learner.predict(np.arange(LENGTH - 1))
    if not (actions == 1).all():
        raise LearnerCheckError(
            f"{subject.name} must learn to go right in a corridor of {LENGTH} places whose right end pays 1; after 300 "
            f"episodes it would do {actions}, the table being {learner.q[0].tolist()}: look at the sign and the "
            f"discount of the target, and whether q[state, action] is what is changed"
        )


def check_changes(subject: Subject) -> None:
    """Check that every row which changes in an episode is recorded, and kept as it was at the episode's end."""
    for problem in (slippery(), drift()):
        learner = subject.on(problem, n_agents=2, tensor_step=subject.tensor_step())
        for episode in range(3 * EVERY):
            before = _shared_tables(learner)
            learner.learn(1)
            if (episode + 1) % EVERY == 0:  # the logs have begun anew, and tables were copied
                continue
            for table, log in enumerate(learner.change_logs):
                if not log.enabled:  # nothing may be weighed or shared here, so that nobody asks what has changed
                    return
                done = int(log.cursor[EPISODES])
                begin = int(log.end[done - 2]) if done > 1 else 0
                recorded = log.state[begin : log.end[done - 1]]
                for name, rows in _shared_tables(learner).items():
                    changed = np.flatnonzero(
                        (rows[table] != before[name][table]).reshape(len(rows[table]), -1).any(axis=1)
                    )
                    missed = np.setdiff1d(changed, recorded)
                    if missed.size:
                        raise LearnerCheckError(
                            f"every row that changes must be recorded, as the tensor step sees no other; "
                            f"{subject.name} changed row {missed[0]} of {name} in episode {episode} and did not record "
                            f"it: call record_change(agent.log, state) before every change of {name}[state]"
                        )


def _shared_tables(learner: Learner) -> dict[str, np.ndarray]:
    """Return copies of the Q-tables, and of declared arrays of which only recorded rows are shared, (N, S, ...)."""
    tables: dict[str, np.ndarray] = {"agent.q": learner.q}
    for declaration in learner.declare_state():
        if isinstance(declaration, DeclaredArray) and declaration.is_shared_by_rows:
            tables[declaration.name] = np.stack([held[declaration.name] for held in learner.declared])
    return tables


def check_targets(subject: Subject, *, bootstraps: bool) -> None:
    """Check the value of a problem of one step, which is known: what it pays, and what comes after it."""
    later = 7.0
    cases = [(True, 0.5, "discount, which is 0 where the return ended, must multiply what comes after")]
    if bootstraps:
        cases.append((False, 0.5 + _GAMMA * later, "an episode that is only cut off goes on: use discount, not ended"))
    for terminated, value, advice in cases:
        initial_q = np.array([[0.0], [later]])
        learner = subject.on(one_step(terminated=terminated), gamma=_GAMMA, initial_q=initial_q).learn(500)
        learned = float(learner.q[0, 0, 0])
        if abs(learned - value) > 1e-6:
            end = "ends" if terminated else "is cut off after"
            raise LearnerCheckError(
                f"a step that pays 0.5, {end} the episode and leads to a state of value {later:g} must become worth "
                f"{value:g} with gamma {_GAMMA}; {subject.name} has {learned:g}: {advice}"
            )


def check_masks(subject: Subject) -> None:
    """Check that what may not be done is neither done nor counted on."""
    initial_q = np.zeros((LENGTH, 3))
    initial_q[:, 2] = FORBIDDEN_VALUE
    learner = subject.on(masked(), initial_q=initial_q).learn(50)
    q = learner.q[0]
    if not (q[:, 2] == FORBIDDEN_VALUE).all():
        state = int(np.argmax(q[:, 2] != FORBIDDEN_VALUE))
        raise LearnerCheckError(
            f"{subject.name} took action 2 in state {state}, where it is forbidden: let the policy choose "
            "(act_by_policy), or look at agent.action_mask"
        )
    if np.abs(q[:, :2]).max() > 1e3:
        raise LearnerCheckError(
            f"{subject.name} counted on forbidden actions: values rose to {np.abs(q[:, :2]).max():g} where 1 is all "
            "that can be earned: take the best value by best_value(agent.q, agent.action_mask, state), or look at "
            "agent.action_mask"
        )


def check_divergence(subject: Subject) -> None:
    """Check that learning stops where a table is not finite any more."""
    try:
        learner = subject.on(overflowing(), alpha=1.0, gamma=1.0)
    except ParameterError:  # it does not even begin with what it cannot keep finite
        return
    learner.learn(5)
    if learner.diverged_at is None:
        raise LearnerCheckError(
            f"learning must stop where a table is not finite any more; {subject.name} went on with "
            f"{learner.q.max():g}: let update, or end_episode, return False where a new value is not finite"
        )


def check_predictions(subject: Subject) -> None:
    """Check that predictions are the most probable actions, one by one and together."""
    learner = subject.on(slippery()).learn(20)
    states = np.arange(learner.problem.n_states)
    together: Any = learner.predict(states, deterministic=True)[0]
    single = [learner.predict(int(state), deterministic=True)[0] for state in states]
    if list(together) != single:
        raise LearnerCheckError(
            f"predictions one by one must be those of a batch; {subject.name} gave {single} and {list(together)}"
        )
    policy, held = learner.acting_policy, learner.declared[0]
    table = policy.table(learner.q[0], held, np.zeros((0, 0), dtype=np.bool_))
    greedy = policy.preferences(table, held).argmax(axis=1)
    if not np.array_equal(together, greedy):
        raise LearnerCheckError(
            f"predictions must be greedy, the lowest action on ties; {subject.name} gave {list(together)} where its "
            f"table says {greedy.tolist()}: keep the values that decide in q, for example the mean of two tables"
        )
