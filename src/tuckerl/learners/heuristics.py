"""The heuristic of learners that need one: how far each state is from the goal."""

from numpy.typing import ArrayLike

from tuckerl.errors import ProblemError
from tuckerl.problems.immutable import read_only
from tuckerl.problems.parts import check_heuristic
from tuckerl.problems.problem import Problem
from tuckerl.types import FloatArray


def heuristic_for(learner: str, problem: Problem, given: ArrayLike | None, instead: str = "") -> FloatArray:
    """Return the heuristic that a learner was given, or else the problem's own, (S,) float64, not to be changed.

    Parameters
    ----------
    learner : str
        The name of its class.
    problem : Problem
    given : (S,) array_like, optional
    instead : str
        What else may be done where there is none, at the end of the message.

    Raises
    ------
    ProblemError
        If there is neither, or it is of the wrong shape or not finite.
    """
    heuristic = problem.heuristic if given is None else given
    if heuristic is None:
        raise ProblemError(
            f"{learner} needs a heuristic and this problem has none of its own: pass heuristic=, {problem.n_states} "
            f"numbers, larger where the goal is farther{instead}"
        )
    return read_only(check_heuristic(heuristic, problem.n_states))
