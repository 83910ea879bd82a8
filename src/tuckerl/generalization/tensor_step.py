"""What a user asks of the tensor step: when it is taken, what is decomposed, what follows from the factors."""

from dataclasses import dataclass

from tuckerl.checks import check_function, check_int, check_name, check_real, check_sequence, shown
from tuckerl.errors import ParameterError
from tuckerl.generalization.sharing import SHARING_RULES, ShareFunction, SharingRule, custom_sharing
from tuckerl.generalization.weights import WEIGHTINGS, WeightFunction, Weighting, custom_weighting
from tuckerl.types import Ranks


@dataclass(frozen=True)
class TensorStep:
    """When and how to factorise the tables, and what to do with the factors.

    Parameters
    ----------
    every : int
        Episodes in a window; the step follows each window.
    ranks : four ints, optional
        Columns of the state, action, episode and agent factors; clipped to what a window allows. They may be left out
        where nothing reads the factors.
    weights : str or callable
        ``"paper"``: row norms of A_p over its norm; ``"relative"``: those over their largest; ``"constant"``:
        1/sqrt(A) for every action; ``"permuted"``: the paper's, dealt to random actions; ``"none"``: 1; or a function
        from a :class:`~tuckerl.TuckerDecomposition` to (A,) numbers.
    share : str or callable
        ``"max"`` or ``"min"``: all agents copy the one of largest or smallest row norm of Ag_p; ``"best"``: of the
        highest mean return in the window; ``"random"``; ``"mean"``: the mean of the tables; ``"visits"``: entry by
        entry, their mean weighted by in how many of the window's episodes each agent changed the entry;
        ``"consensus"``: their mean weighted by those norms; ``"none"``; or a function from a ``ShareContext`` to an
        agent's index, mixture weights of the tables or of their entries, or None.
    floor : float
        Weights below it are raised to it. 0, the paper's rule, lets an action without values stop learning.
    tol, max_iterations : float, int
        When the decomposition stops; 0 iterations is the truncated HOSVD.

    Raises
    ------
    ParameterError, ParameterTypeError, UnknownNameError
        If a parameter is out of its range, of the wrong type or not a known name, or ranks are needed and missing.

    References
    ----------
    The paper's Figures 5, 7 and 8; ``"visits"`` is this library's own.
    """

    every: int
    ranks: Ranks | None = None
    weights: str | WeightFunction = "paper"
    share: str | ShareFunction = "max"
    floor: float = 0.0
    tol: float = 1e-4
    max_iterations: int = 50

    def __post_init__(self) -> None:
        object.__setattr__(self, "every", check_int("every", self.every, 1))
        if self.ranks is not None:
            object.__setattr__(self, "ranks", _check_ranks(self.ranks))
        for name, value, known in (("weights", self.weights, WEIGHTINGS), ("share", self.share, SHARING_RULES)):
            if callable(value):
                check_function(name, value, "decomposition" if name == "weights" else "context")
            else:
                check_name(name, value, known)
        object.__setattr__(self, "floor", check_real("floor", self.floor, 0.0, 1.0))
        object.__setattr__(self, "tol", check_real("tol", self.tol, 0.0))
        object.__setattr__(self, "max_iterations", check_int("max_iterations", self.max_iterations, 0))
        if self.ranks is None and self.needs_decomposition:
            raise ParameterError(
                f"ranks must be given, as the factors of a decomposition are read by {' and '.join(self._readers)}: "
                "four whole numbers such as (15, 3, 9, 1); weights='none' with share='visits' needs none"
            )

    @property
    def weighting(self) -> Weighting:
        """The strategy that `weights` names."""
        return WEIGHTINGS[self.weights] if isinstance(self.weights, str) else custom_weighting(self.weights)

    @property
    def sharing(self) -> SharingRule:
        """The rule that `share` names."""
        if isinstance(self.share, str):
            return SHARING_RULES[self.share]
        return custom_sharing(self.share, reads_norms=self.ranks is not None)

    @property
    def needs_decomposition(self) -> bool:
        """Whether anything reads the factors: the constant control without sharing, for one, does not."""
        return bool(self._readers)

    @property
    def _readers(self) -> list[str]:
        """What reads the factors, in words."""
        named = (("weights", self.weights, self.weighting), ("share", self.share, self.sharing))
        return [f"{name}={shown(value)}" for name, value, rule in named if rule.needs_decomposition]

    def logged_episodes(self, n_agents: int) -> int:
        """Return of how many episodes the changes are kept, for something to read them; 0 if nothing does."""
        reads_changes = self.sharing.needs_changes and n_agents > 1
        return self.every if self.needs_decomposition or reads_changes else 0


def _check_ranks(ranks: object) -> tuple[int, ...]:
    expected = "four whole numbers of at least 1, for the state, action, episode and agent axes"
    asked = check_sequence("ranks", ranks, expected, 4)
    return tuple(check_int(f"the {axis} rank", rank, 1) for axis, rank in zip(_AXES, asked, strict=True))


_AXES = ("state", "action", "episode", "agent")
