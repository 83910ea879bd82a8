"""What every learner must keep to: checks for those who write one."""

import inspect
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_flag, shown
from tuckerl.errors import LearnerCheckError, LearnerError, ParameterTypeError
from tuckerl.testing import declaring, learning, repeating, slips
from tuckerl.testing.subject import Subject
from tuckerl.training.learner import Learner
from tuckerl.training.parameters import NOT_SAVED, keywords_of


def check_learner(
    learner_class: type[Learner],
    *,
    env: Environment | None = None,
    parameters: Mapping[str, Any] | None = None,
    bootstraps: bool = True,
    discounts: bool = True,
) -> None:
    """Look for the usual mistakes in a learner of your own; say what the first one breaks and what usually causes it.

    On small problems (a corridor, a slippery floor, one with forbidden actions, a simulator, an environment that Python
    steps), for one agent and three, with and without a tensor step: kernels stay within their arrays (they are
    interpreted first, in a process of its own); it learns; tables stay finite or learning stops; no
    forbidden action is taken or believed in; terminal steps are not bootstrapped, and truncated ones are; every row
    that changes is recorded, and every array that changes is declared, shared and saved; the same seed gives the same
    bits; learning in two parts, with or without a file between them, equals learning at once; agents do not depend on
    how many there are; predictions follow what is learned.

    Parameters
    ----------
    learner_class : subclass of Learner
    env
        A problem to be repeated on beside those, for example a PettingZoo environment whose agents learn side by side;
        there are to be several of it, so it is best given by id or as a callable.
    parameters : mapping, optional
        Keywords for the constructor, beside `alpha`, `gamma`, `epsilon`, `initial_q`, `n_agents`, `tensor_step` and
        `seed`, which the checks choose.
    bootstraps : bool
        False for methods that never bootstrap, such as Monte Carlo's: a step that was cut off is not looked at then.
    discounts : bool
        False for methods of the average reward, such as R-learning: they are given no `gamma`, and their values, which
        are relative, are not compared with what a single step is worth.

    Raises
    ------
    LearnerCheckError
        If the learner breaks one of these promises.
    ParameterTypeError
        If `learner_class` is no learner, or a parameter is one that the checks choose.

    Examples
    --------
    >>> import tuckerl
    >>> from tuckerl.testing import check_learner
    >>> check_learner(tuckerl.QLearning)
    """
    given: object = learner_class
    if not (inspect.isclass(given) and issubclass(given, Learner)):
        raise ParameterTypeError(
            f"learner_class must be a subclass of tuckerl.training.learner.Learner; got {shown(learner_class)}"
        )
    own = dict(parameters or {})
    chosen = {"alpha", "gamma", "epsilon", "initial_q", "n_agents", "tensor_step", "seed"} & set(own)
    if chosen:
        raise ParameterTypeError(f"parameters must leave {', '.join(sorted(chosen))} to the checks")
    subject = Subject(learner_class, own, discounts=check_flag("discounts", discounts))
    with warnings.catch_warnings(), _mistakes_of_kernels():
        warnings.simplefilter("ignore")  # of ranks and of divergence, which are meant
        _check_parameters(subject)
        slips.check_slips(subject)
        declaring.check_declarations(subject)
        learning.check_corridor(subject)
        learning.check_changes(subject)
        if subject.discounts:
            learning.check_targets(subject, bootstraps=check_flag("bootstraps", bootstraps))
        learning.check_masks(subject)
        learning.check_divergence(subject)
        learning.check_predictions(subject)
        repeating.check_repeats(subject, env)


@contextmanager
def _mistakes_of_kernels() -> Iterator[None]:
    """Name what guards find as what it is here: a broken promise."""
    try:
        yield
    except LearnerError as error:
        raise LearnerCheckError(str(error)) from error


def _check_parameters(subject: Subject) -> None:
    """Check that parameters reach the learner, and that unknown ones do not go unnoticed."""
    chosen = {"alpha": 0.25, "gamma": 0.75, "epsilon": 0.5}
    learner = subject.on_corridor(**chosen)
    for name in keywords_of(subject.learner_class):
        if name not in NOT_SAVED and not hasattr(learner, name):
            raise LearnerCheckError(
                f"a learner keeps each parameter of its constructor as an attribute of the same name, which is how a "
                f"file holds it; {subject.name} has no attribute {name!r}: set self.{name} = {name}"
            )
    for name, value in chosen.items():
        if (name != "gamma" or subject.discounts) and getattr(learner, name) != value:
            raise LearnerCheckError(
                f"{subject.name}({name}={value}) has {name}={getattr(learner, name)}: pass all keywords on, "
                "super().__init__(env, **parameters)"
            )
    try:
        subject.on_corridor(alhpa=0.25)
    except (TypeError, ValueError) as error:
        if "alhpa" in str(error):
            return
        raise LearnerCheckError(
            f"{subject.name}(alhpa=0.25) must name the unknown parameter; it raised {shown(error)}: pass all keywords "
            "on, super().__init__(env, **parameters)"
        ) from error
    raise LearnerCheckError(
        f"{subject.name}(alhpa=0.25) must be refused, as there is no such parameter; nothing was raised: pass all "
        "keywords but your own on, super().__init__(env, **parameters)"
    )
