"""Checks by kind of problem, and that the transitions that an environment carries are those of its own steps."""

from collections.abc import Callable
from typing import Any

import numpy as np

from tuckerl.adapters.carried import is_outcome
from tuckerl.errors import ProblemCheckError
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.problem import Problem
from tuckerl.problems.simulator import Simulator
from tuckerl.testing.arrays import check_arrays
from tuckerl.testing.playing import Moment
from tuckerl.testing.simulators import check_simulator

_TOLERANCE = 1e-9
_ADVICE = "correct one of them, or learn with compiled=False"


def check_carried(problem: Problem, stage: Any, played: list[Moment], episodes: int, seed: int) -> None:
    """Check the transitions that an environment carries, which learners play: by themselves, and by what was played.

    Parameters
    ----------
    problem : Problem
    stage
        Has `source` and `observations`, the encoder of what `played` observed.
    played : list of Moment
    episodes, seed : int
        What `check_problem` was given.

    Raises
    ------
    ProblemCheckError
    """
    if problem.kind in KIND_CHECKS:
        check_alone, check_played = KIND_CHECKS[problem.kind]
        check_alone(problem, stage.source, episodes, seed)
        sizes = (stage.observations.n if stage.observations else "uncountably many", stage.actions.n)
        if sizes != (problem.n_states, problem.n_actions):
            raise ProblemCheckError(
                f"the transitions that {stage.source} carries have {problem.n_states} states and {problem.n_actions} "
                f"actions, and its spaces have {sizes[0]} and {sizes[1]}: {_ADVICE}"
            )
        check_played(problem, stage, played)


def _check_table(mdp: TabularMDP, stage: Any, played: list[Moment]) -> None:
    """Check that everything that was played is in the table that the environment carries."""
    state = 0
    for moment in played:
        after = int(stage.observations.encode(moment.observation))
        if moment.action is None:
            if after not in mdp.arrays.start_state:
                raise ProblemCheckError(
                    f"{stage.source} began in state {after} {moment.where}, which is no first state of the table that "
                    f"it carries: {_ADVICE}"
                )
        elif not is_outcome(mdp, state, moment.action, after, moment.reward, moment.terminated):
            raise ProblemCheckError(
                f"action {moment.action} in state {state} led {stage.source} to state {after} with reward "
                f"{moment.reward} and terminated {bool(moment.terminated)} {moment.where}, which the table that it "
                f"carries does not hold: {_ADVICE}"
            )
        if not moment.terminated and moment.mask is not None and mdp.action_mask is not None:
            allowed = mdp.action_mask[after]
            if not np.array_equal(allowed, moment.mask):
                raise ProblemCheckError(
                    f"{stage.source} allowed the actions {np.flatnonzero(moment.mask)} in state {after} "
                    f"{moment.where}, and the table that it carries {np.flatnonzero(allowed)}: {_ADVICE}"
                )
        state = after


def _check_simulator(simulator: Simulator, stage: Any, played: list[Moment]) -> None:
    """Check that a simulator that draws nothing does what the environment that carries it did."""
    functions, parameters = simulator.functions, simulator.parameters
    state, words = np.zeros(simulator.state_size), np.arange(1, 5, dtype=np.uint64)
    before = words.copy()
    for moment in played:
        reward, terminated = 0.0, False
        if moment.action is None:
            functions.reset(parameters, state, words)
        else:
            reward, terminated = functions.step(parameters, state, moment.action, words)
        if not np.array_equal(words, before):  # by chance: the environment's own draws are others
            return
        row, seen = functions.index(parameters, state), stage.observations.encode(moment.observation)
        if row != seen or terminated != moment.terminated or abs(reward - moment.reward) > _TOLERANCE:
            raise ProblemCheckError(
                f"{stage.source} came to state {seen} with reward {moment.reward} and terminated "
                f"{bool(moment.terminated)} {moment.where}, and the simulator that it carries to {row} with {reward} "
                f"and {bool(terminated)}: {_ADVICE}"
            )


KIND_CHECKS: dict[str, tuple[Callable[[Any, str, int, int], None], Callable[[Any, Any, list[Moment]], None]]] = {
    TabularMDP.kind: (lambda mdp, source, *_: check_arrays(mdp, source), _check_table),
    Simulator.kind: (
        lambda problem, source, episodes, seed: check_simulator(problem, episodes, seed),
        _check_simulator,
    ),
}
"""By kind of problem: a check of the problem alone, and one of an environment that carries it."""
