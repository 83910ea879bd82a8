"""Parameters that can be assigned after construction: checked as the constructor checks them, in force from then on.

There is one way for all of them, also for those of a learner of one's own: its constructor is run again, on the learner
itself, with what it keeps of its parameters and the new value. What was learned stays where it is. So a learner whose
parameter was assigned is the one that `load` makes of its file, and an author needs to do nothing.
"""

from abc import ABCMeta
from collections.abc import Mapping
from typing import Any, ClassVar, Never

from tuckerl.checks import did_you_mean, shown
from tuckerl.errors import ImmutableError, ParameterError, ParameterTypeError
from tuckerl.problems.immutable import seal
from tuckerl.training.agent_arrays import Settings
from tuckerl.training.learned import Learned
from tuckerl.training.one_owner import Owner
from tuckerl.training.parameters import check_known, given_parameters, keywords_of
from tuckerl.training.python_calls import PythonCall

_FIXED = "{name} cannot change once a learner is made, as its tables or streams are made by it: make a new {kind}"


class _Sealing(ABCMeta):
    """The class of classes whose objects know when their constructor, the whole of it, has returned."""

    def __call__(cls, *arguments: Any, **parameters: Any) -> Any:
        return seal(super().__call__(*arguments, **parameters))


class LiveParameters(Learned, metaclass=_Sealing):
    """The part of every learner that takes other parameters while it lives."""

    fixed_parameters: ClassVar[tuple[str, ...]] = (
        "env",
        "problem",
        "n_agents",
        "initial_q",
        "tensor_step",
        "seed",
        "seed_sequence",
        "bins",
        "compiled",
        "team_reward",
    )
    """What cannot be assigned once a learner is made. One that has more to add to it writes
    ``fixed_parameters = (*Learner.fixed_parameters, "order")``."""

    _owner: Owner
    _python_calls: list[PythonCall]

    def __setattr__(self, name: str, value: Never) -> None:  # type checkers need not believe that all can be assigned
        """Set an attribute; a parameter is checked as by the constructor, and is in force from the next episode.

        Raises
        ------
        ParameterError, ParameterTypeError, UnknownNameError, ...
            Whatever the constructor raises for this value. The learner stays as it was.
        ImmutableError
            If this cannot change, or there is no such attribute.
        LearnerInUseError
            If another thread uses the learner, or it is in the middle of an episode.
        """
        if name.startswith("_"):
            super().__setattr__(name, value)
        elif "_is_made" not in vars(self):  # in a constructor, which runs again where a parameter changes
            if "_owner" in vars(self):  # not yet, in a class whose __new__ is its own
                self._owner.check_thread(f"{type(self).__name__}.{name} = ...")
            super().__setattr__(name, value)
        elif name in self.fixed_parameters:
            raise ImmutableError(_FIXED.format(name=name, kind=type(self).__name__))
        elif name in keywords_of(type(self)):
            self.change({name: value})
        elif isinstance(viewed := getattr(type(self), name, None), property) and viewed.fset is None:
            raise ImmutableError(f"{name} cannot be assigned: it shows what the learner is and has learned")
        elif hasattr(self, name):
            super().__setattr__(name, value)
        else:
            known = _assignable(type(self))
            hint = did_you_mean(name, known) or f"what can be assigned is {', '.join(known)}"
            raise ImmutableError(f"{type(self).__name__} has no attribute {shown(name)}: {hint}")

    def __delattr__(self, name: str) -> None:
        if name in keywords_of(type(self)) and "_is_made" in vars(self):
            raise ImmutableError(f"{name} cannot be deleted: a learner keeps its parameters, which files hold")
        super().__delattr__(name)

    def revise_state(self, before: Settings, now: Settings) -> None:
        """Bring what is declared into line with parameters that have just been assigned.

        Nothing is to be done where kernels read parameters alone, as constants or schedules. A learner whose declared
        arrays hold what follows from a parameter, such as a model's discounts, writes them anew here.

        Parameters
        ----------
        before, now : Settings
            What was in force, and what is now.

        Raises
        ------
        ImmutableError
            Before anything was changed, if the arrays do not say enough: the assignment is refused.
        """

    @classmethod
    def check_changes(cls, changes: Mapping[str, Any]) -> None:
        """Refuse, for `load`, parameters that there are not, or that cannot differ from the saved ones."""
        check_known(cls, changes)
        for name in changes:
            if name in cls.fixed_parameters:
                raise ParameterError(_FIXED.format(name=name, kind=cls.__name__))

    def change(self, changes: Mapping[str, Any]) -> None:
        """Go on with other values of some parameters, as an assignment of all of them at once.

        The constructor runs again. Whatever it raises, nothing has changed then.
        """
        if not isinstance(changes, Mapping):
            raise ParameterTypeError(f"changes must be a mapping of parameters by name; got {shown(changes)}")
        if not changes:
            return
        self.check_changes(changes)
        parameters = given_parameters(self)
        if changes.get("policy") is not None:  # it takes the place of what made the default policy
            parameters = {name: parameters[name] for name in parameters.keys() - {"epsilon", "epsilon_decay"}}
        parameters |= changes
        with self._owner.at_rest(f"{type(self).__name__}.{min(changes)} = ..."):
            state, calls = self._state, self._python_calls
            held, learned, called = dict(vars(self)), dict(vars(state)), list(calls)
            del vars(self)["_is_made"]
            calls.clear()
            try:
                self.__init__(self.problem, **parameters)  # type: ignore[misc]  # that is the way
                self.revise_state(learned["rules"].settings, state.rules.settings)
            except BaseException:
                vars(self).update(held)
                vars(state).update(learned)
                calls[:] = called
                raise
            seal(self)


def _assignable(kind: type[LiveParameters]) -> tuple[str, ...]:
    return tuple(name for name in keywords_of(kind) if name not in kind.fixed_parameters)
