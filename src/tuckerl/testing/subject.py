"""The learner that is checked, and how it is made."""

from typing import Any

import numpy as np

from tuckerl.errors import LearnerCheckError
from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.testing.small_problems import corridor
from tuckerl.training.learner import Learner

EVERY = 5
"""Episodes of a window."""


class Subject:
    """A class of learners with the parameters that its user gave; `discounts` says whether it takes a gamma."""

    def __init__(self, learner_class: type[Learner], parameters: dict[str, Any], *, discounts: bool = True) -> None:
        self.learner_class, self.name, self.discounts = learner_class, learner_class.__name__, discounts
        self._parameters = parameters

    def on(self, env: Any, **chosen: Any) -> Learner:
        """Return a new learner on a problem."""
        common: dict[str, Any] = {"alpha": 0.3, "gamma": 0.9, "epsilon": 0.2, "seed": 0}
        given = common | self._parameters | chosen
        if not self.discounts:
            del given["gamma"]
        return self.learner_class(env, **given)

    def on_corridor(self, **chosen: Any) -> Learner:
        """Return a new learner in the corridor."""
        return self.on(corridor(), **chosen)

    def tensor_step(self) -> TensorStep:
        """Return a step that weighs actions and copies tables, as far as that means something to the learner."""
        learner = self.on_corridor()
        weights = "paper" if learner.why_no_weights() is None else "none"
        share = "max" if learner.why_no_sharing() is None else "none"
        return TensorStep(every=EVERY, ranks=(3, 2, 2, 1), weights=weights, share=share, floor=0.1)


def check_same(learner: Learner, other: Learner, what: str, advice: str) -> None:
    """Check that two learners have learned the same, to the last bit.

    Raises
    ------
    LearnerCheckError
        ``what``, then where they part, then ``advice``.
    """
    for name in ("steps", "returns", "q", "action_weights"):
        ours, theirs = getattr(learner, name), getattr(other, name)
        if ours.shape != theirs.shape:
            raise LearnerCheckError(f"{what}; {name} had the shape {ours.shape}, then {theirs.shape}: {advice}")
        if not np.array_equal(ours, theirs):
            where = tuple(int(i) for i in np.argwhere(ours != theirs)[0])
            raise LearnerCheckError(f"{what}; {name}{list(where)} was {ours[where]}, then {theirs[where]}: {advice}")
