"""Every error and warning that tuckerl raises on purpose.

Each error is also the built-in kind it specialises, so ``except ValueError`` keeps working, and all of them
are a :class:`TuckerlError`. A message says what was expected, what came, and what to do next, in one sentence.
"""

import sys
import warnings
from pathlib import Path
from types import FrameType

_PACKAGE = str(Path(__file__).parent)
LONGEST_MESSAGE = 600
"""Characters that a message has at most: what is in the middle of a longer one is left out."""


def warn(message: str, category: type[Warning]) -> None:
    """Warn at the line of the user's program that called this library, however deep in it the reason lies."""
    frame: FrameType | None = sys._getframe()
    depth = 1
    while frame is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        frame, depth = frame.f_back, depth + 1
    warnings.warn(message, category, stacklevel=depth)


class TuckerlError(Exception):
    """Base of all errors raised on purpose by this library."""

    def __init__(self, *args: object) -> None:
        super().__init__(*(shortened(part) if isinstance(part, str) else part for part in args))


def shortened(part: str) -> str:
    """Return a message with its beginning, which says what is wrong, and its end, which says what to do."""
    if len(part) <= LONGEST_MESSAGE:
        return part
    end = LONGEST_MESSAGE // 3
    return f"{part[: LONGEST_MESSAGE - end - 5]} ... {part[-end:]}"


class ParameterError(TuckerlError, ValueError):
    """A parameter has the right type and an impossible value."""


class ParameterTypeError(TuckerlError, TypeError):
    """A parameter has the wrong type."""


class UnknownNameError(TuckerlError, ValueError):
    """A name (of a scenario, environment, weighting, ...) is not one of those known."""


class TensorError(TuckerlError, ValueError):
    """An array cannot be decomposed: not numeric, not finite, or of the wrong order."""


class DecompositionError(TuckerlError, ArithmeticError):
    """A finite matrix has no factors that linear algebra can find; a window of a learner is passed over then."""


class ProblemError(TuckerlError, ValueError):
    """A problem's arrays contradict each other, or a problem lacks what a learner needs."""


class MazeError(ProblemError):
    """A maze cannot be made as asked, or has no path from its start to its goal."""


class SimulatorError(ProblemError):
    """A simulator's function does not compile, or returned an impossible state or number."""


class SpaceError(ProblemError):
    """A space cannot be numbered: it is continuous and has no bins, unbounded, or of an unknown kind."""


class NoTableError(ProblemError):
    """An environment's transitions are needed, and none are known to be those of its steps.

    Attributes
    ----------
    fact : str
        What is missing; the message goes on with what to do, which depends on what the transitions were needed for.
    """

    def __init__(self, fact: str, advice: str = "") -> None:
        super().__init__(fact + advice)
        self.fact = fact


class SolverError(TuckerlError, ArithmeticError):
    """A known problem was not solved by the method that was asked for."""


class ObservationError(TuckerlError, ValueError):
    """An observation does not lie in the space that it should come from."""


class EnvironmentFaultError(TuckerlError, RuntimeError):
    """An environment raised an error or returned something impossible while a learner was stepping it."""


class LearnerError(TuckerlError, TypeError):
    """A class of learners lacks what it needs to learn."""


class LearnerInUseError(TuckerlError, RuntimeError):
    """A learner was used by two threads at once, or from inside of what it was doing."""


class TableSizeError(ProblemError, MemoryError):
    """Something would take more memory than is free; it was not begun."""


class ImmutableError(TuckerlError, AttributeError):
    """Something was to be changed that does not change once it is made."""


class ProblemCheckError(TuckerlError, AssertionError):
    """A problem breaks a promise that learners rely on."""


class LearnerCheckError(TuckerlError, AssertionError):
    """A learner breaks a promise that its users rely on."""


class SavedFileError(TuckerlError, ValueError):
    """A file is truncated, damaged, of another kind or of a newer version."""


class SavedFileMissingError(TuckerlError, FileNotFoundError):
    """There is no file where a saved learner was looked for."""


class OutputError(TuckerlError, OSError):
    """A result cannot be written where it was asked for."""


class WorkerError(TuckerlError, RuntimeError):
    """The processes that were to play a study's runs do not live, cannot be reached, or cannot play them."""


class OutputConflictError(TuckerlError, FileExistsError):
    """A folder holds the results of another specification."""


class MissingExtraError(TuckerlError, ImportError):
    """Something needs a library that comes only with one of the package's extras."""


class RankWarning(UserWarning):
    """Ranks above what is possible were clipped."""


class ZeroWeightWarning(UserWarning):
    """An action weight is zero: that action does not learn while it lasts."""


class DecompositionWarning(RuntimeWarning):
    """The tables of a window could not be decomposed: weights and tables stayed as they were."""


class StepCapWarning(UserWarning):
    """An episode of an environment without a time limit was cut off."""


class ResumeWarning(UserWarning):
    """A learner that goes on from a file will not draw what it would have drawn without it."""


class KernelCacheWarning(RuntimeWarning):
    """Compiled kernels cannot be kept on disk, or not be read: each process compiles them."""


class DamagedResultsWarning(RuntimeWarning):
    """A file of a study's results is not what was written: it was set aside, and its runs are played again."""


class WorkerWarning(RuntimeWarning):
    """Workers of a cluster are missing, are not used, or not wholly."""


class FailedRunsWarning(RuntimeWarning):
    """Runs of a study ended with an error."""


class DivergenceWarning(RuntimeWarning):
    """A table was not finite any more, and learning was stopped there."""
