"""What every problem must keep to, whatever its kind."""

import pettingzoo

from tuckerl.adapters.making import made_of
from tuckerl.adapters.resolve import Environment, as_problem
from tuckerl.checks import check_int
from tuckerl.errors import ProblemCheckError, ProblemError
from tuckerl.problems.maze import Maze
from tuckerl.problems.problem import Problem
from tuckerl.testing.carried import KIND_CHECKS
from tuckerl.testing.environments import check_environment
from tuckerl.testing.parallel import check_parallel


def check_problem(problem: Environment, *, episodes: int = 20, seed: int = 0) -> None:
    """Look for the usual mistakes in a problem, and say how to correct the first that is found.

    * Arrays and mazes: every episode can end or has a time limit, and there is no trap that should have been an end.
    * Simulators: the functions are called in plain Python and as compiled code, and must agree; they depend on nothing
      but what they are given, write to nothing but the state, and return what they should.
    * Gymnasium and PettingZoo environments: the libraries' own tests; what is observed lies in the spaces, which stay
      as they are; seeds decide what happens, and two environments side by side do not touch each other; masks allow
      something; transitions that an environment carries are those that its own steps make.

    Random play cannot show all that may be wrong: a problem that passes may have mistakes still.

    Parameters
    ----------
    problem
        As learners take it, but for what a Box is cut into: a :class:`~tuckerl.TabularMDP`, :class:`~tuckerl.Maze` or
        :class:`~tuckerl.Simulator`, or an environment by id, instance or a callable that makes one.
    episodes : int
        How many are played at random; fewer where they take more than 20,000 steps.
    seed : int
        Decides what is played.

    Raises
    ------
    ProblemCheckError
        If there is a mistake: it names what was expected, what came, and what to do.
    ParameterError, ParameterTypeError, UnknownNameError
        If `problem` is none, or a parameter is impossible.

    Examples
    --------
    >>> import tuckerl
    >>> from tuckerl.testing import check_problem
    >>> check_problem(tuckerl.cart_pole())
    >>> check_problem("tuckerl/DynaMaze-v0", episodes=2)
    """
    n_episodes, number = check_int("episodes", episodes, 1), check_int("seed", seed, 0)
    if isinstance(problem, (Problem, Maze)) and (own := as_problem(problem)).kind in KIND_CHECKS:
        KIND_CHECKS[own.kind][0](own, repr(problem), n_episodes, number)
    else:
        env, make = made_of(problem, "problem")
        check = check_parallel if isinstance(env, pettingzoo.ParallelEnv) else check_environment
        try:
            check(env, make, n_episodes, number)
        except ProblemError as error:  # spaces that have no numbers, a first observation that is in none, ...
            raise ProblemCheckError(str(error)) from error
        finally:
            if make is not None:
                env.close()
