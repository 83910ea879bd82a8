"""What usually goes wrong with a learner of one's own is found, and the message says how to correct it."""

from typing import Any, Self

import numpy as np
import pytest

import tests.testing.learners as faults
from tests.testing.learners import MadeAnew, OneForAll, Undeclared, wrong
from tuckerl import QLearning, SarsaLambda
from tuckerl.adapters.gymnasium_problem import GymnasiumProblem
from tuckerl.errors import LearnerCheckError, ParameterTypeError
from tuckerl.testing import check_learner


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (faults.ASCENDS, r"must learn to go right .* look at the sign"),
        (faults.UNMARKED, r"changed row \d of agent.q in episode 0 and did not record it: call record_change"),
        (faults.MARKED_LATE, r"changed row \d of agent.q in episode \d and did not record it: call record_change"),
        (faults.BOOTSTRAPS_ENDS, r"ends the episode .* worth 0.5 .* Wrong has 6.8: discount, which is 0"),
        (faults.DROPS_TRUNCATED, r"is cut off .* worth 6.8 .* Wrong has 0.5: .* use discount, not ended"),
        (faults.TAKES_ANY, r"returned action 2 in state \d, where it is forbidden: look at agent.action_mask"),
        (faults.BELIEVES_ANY, r"counted on forbidden actions: values rose to .* best_value"),
        (faults.IGNORES_INFINITY, r"learning must stop .* let update, or end_episode, return False"),
        (faults.UNSEEDED, r"same seed must learn the same; .* draw by tuckerl.rng.uniform"),
    ],
)
def test_a_fault_in_kernels_is_found(fault: int, message: str) -> None:
    with pytest.raises(LearnerCheckError, match=message):
        check_learner(wrong(fault))


class Deaf(QLearning):
    """Takes what it does not know."""

    def __new__(cls, *arguments: Any, **parameters: Any) -> Self:
        parameters.pop("alhpa", None)
        return super().__new__(cls, *arguments, **parameters)

    def __init__(self, env: Any, **parameters: Any) -> None:
        parameters.pop("alhpa", None)
        super().__init__(env, **parameters)


class Stubborn(QLearning):
    """Has its own alpha."""

    def __init__(self, env: Any, **parameters: Any) -> None:
        super().__init__(env, **(parameters | {"alpha": 0.1}))


class Unsaid(QLearning):
    """Does not keep its own parameter where a file's writer looks for it."""

    def __init__(self, env: Any, *, boldness: float, **parameters: Any) -> None:
        super().__init__(env, **parameters)
        self._boldness = boldness


class Backwards(QLearning):
    """Would do the opposite of what it learned, where it is asked for several states."""

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool | None = None,
        *,
        action_masks: Any = None,
    ) -> tuple[Any, None]:
        actions, _ = super().predict(observation, deterministic=deterministic)
        return (1 - actions, None) if isinstance(observation, int) else (actions, None)


class Elsewhere(QLearning):
    """Would do what is best elsewhere."""

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool | None = None,
        *,
        action_masks: Any = None,
    ) -> tuple[Any, None]:
        if self.problem.n_states == 6:
            return super().predict((np.asarray(observation) + 1) % 6 if np.ndim(observation) else (observation + 1) % 6)
        return super().predict(observation)


class Fixed(QLearning):
    """Has its own seed."""

    def __init__(self, env: Any, **parameters: Any) -> None:
        super().__init__(env, **(parameters | {"seed": 0}))


class Alike(QLearning):
    """Its agents draw the same."""

    def __init__(self, env: Any, **parameters: Any) -> None:
        super().__init__(env, **parameters)
        self._state.streams = [self._state.streams[0].copy() for _ in self._state.streams]


class Peeks(QLearning):
    """Learns otherwise where Python steps."""

    def __init__(self, env: Any, **parameters: Any) -> None:
        super().__init__(env, **parameters)
        if isinstance(self.problem, GymnasiumProblem):
            rules = self._state.rules
            self._state.rules = rules._replace(settings=rules.settings._replace(gamma=0.5))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("learner", "parameters", "message"),
    [
        (
            Undeclared,
            {},
            r"'updates' of ExpectedSarsaState changed while Undeclared learned: .* from declare_state instead",
        ),
        (MadeAnew, {}, r"learning 13 and then 5 episodes must equal learning 18.* not one that constants makes anew"),
        (OneForAll, {}, r"agents must not depend on how many there are.* declare_state what an agent keeps"),
        (Deaf, {}, r"Deaf\(alhpa=0.25\) must be refused"),
        (Stubborn, {}, r"Stubborn\(alpha=0.25\) has alpha=0.1: pass all keywords on"),
        (Unsaid, {"boldness": 1.0}, r"Unsaid has no attribute 'boldness': set self.boldness = boldness"),
        (Fixed, {}, r"with the seeds 0 and 1 it learned the same on a slippery floor"),
        (Alike, {}, r"two agents of Alike learned the same by chance"),
        (Peeks, {}, r"the same from a corridor's arrays as from the corridor stepped in Python; q\[0, \d, \d\] was"),
        (Backwards, {}, r"predictions one by one must be those of a batch"),
        (Elsewhere, {}, r"predictions must be greedy, the lowest action on ties"),
    ],
)
def test_a_fault_in_the_class_is_found(learner: Any, parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(LearnerCheckError, match=message):
        check_learner(learner, parameters=parameters)


def test_what_is_declared_may_be_counted_with() -> None:
    check_learner(wrong(faults.COUNTS))


def test_a_learner_that_draws_nothing_has_no_seed() -> None:
    with pytest.raises(LearnerCheckError, match=r"must learn to go right"):  # it never explores
        check_learner(wrong(faults.DETERMINED))


def test_what_is_no_learner_is_refused() -> None:
    with pytest.raises(ParameterTypeError, match=r"must be a subclass of tuckerl.training.learner.Learner; got 'Q'"):
        check_learner("Q")  # type: ignore[arg-type]
    with pytest.raises(ParameterTypeError, match="parameters must leave alpha, seed to the checks"):
        check_learner(SarsaLambda, parameters={"alpha": 0.1, "seed": 1, "lambda_": 0.5})


def test_methods_that_never_bootstrap_are_not_asked_to() -> None:
    with pytest.raises(LearnerCheckError, match="cut off"):
        check_learner(wrong(faults.DROPS_TRUNCATED))
    check_learner(wrong(faults.DROPS_TRUNCATED), bootstraps=False)
