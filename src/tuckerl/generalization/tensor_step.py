"""What a user asks of the tensor step: when it is taken, what is decomposed, what follows from the factors."""

from dataclasses import dataclass

from tuckerl.checks import check_function, check_int, check_name, check_real, shown
from tuckerl.errors import ParameterError
from tuckerl.generalization.sharing import SHARING_RULES, ShareFunction, SharingRule, custom_sharing
from tuckerl.generalization.weights import WEIGHTINGS, WeightFunction, Weighting, custom_weighting
from tuckerl.tensor.ranks import check_ranks
from tuckerl.types import AskedRanks


@dataclass(frozen=True)
class TensorStep:
    """When and how to factorise the tables, and what to do with the factors.

    Parameters
    ----------
    every : int
        Episodes in a window; the step follows each window.
    ranks : four ints, "auto" or float, optional
        Columns of the state, action, episode and agent factors, clipped to what a window allows; or a share of the
        energy in (0, 1], "auto" for 0.95: anew for each window, in each mode the least rank whose singular values carry
        that share of the tables' squares. They may be left out where nothing reads the factors.
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
    shrink : float
        After sharing, each agent's rows of the window become (1 - shrink) Q + shrink times what the decomposition says
        of its own table after the window's last episode.
    share_every : int, optional
        Episodes from one sharing to the next, over which returns and changes are counted; by default `every`. One of
        the two must be a multiple of the other. The weights change every `every` episodes, whatever it is.

    Raises
    ------
    ParameterError, ParameterTypeError, UnknownNameError
        If a parameter is out of its range, of the wrong type or not a known name, if ranks are needed and missing, or
        if `share_every` does not go with `every`.

    References
    ----------
    The paper's Figures 5, 7 and 8; ``"visits"`` is this library's own.
    """

    every: int
    ranks: AskedRanks | None = None
    weights: str | WeightFunction = "paper"
    share: str | ShareFunction = "max"
    floor: float = 0.0
    tol: float = 1e-4
    max_iterations: int = 50
    shrink: float = 0.0
    share_every: int | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "every", check_int("every", self.every, 1))
        if self.ranks is not None:
            checked = check_ranks(self.ranks, _EXPECTED_RANKS, _RANKS)
            object.__setattr__(self, "ranks", str(self.ranks) if isinstance(self.ranks, str) else checked)
        for name, value, known in (("weights", self.weights, WEIGHTINGS), ("share", self.share, SHARING_RULES)):
            if callable(value):
                check_function(name, value, "decomposition" if name == "weights" else "context")
            else:
                check_name(name, value, known)
        object.__setattr__(self, "floor", check_real("floor", self.floor, 0.0, 1.0))
        object.__setattr__(self, "tol", check_real("tol", self.tol, 0.0))
        object.__setattr__(self, "max_iterations", check_int("max_iterations", self.max_iterations, 0))
        object.__setattr__(self, "shrink", check_real("shrink", self.shrink, 0.0, 1.0))
        self._check_share_every()
        if self.ranks is None and self.needs_decomposition:
            raise ParameterError(
                f"ranks must be given, as the factors of a decomposition are read by {' and '.join(self._readers)}: "
                "four whole numbers such as (15, 3, 9, 1), or 'auto'; weights='none' with share='visits' needs none"
            )

    def _check_share_every(self) -> None:
        if self.share_every is None:
            return
        object.__setattr__(self, "share_every", check_int("share_every", self.share_every, 1))
        longer, shorter = max(self.every, self.share_interval), self.interval
        if longer % shorter:
            raise ParameterError(
                f"one of every and share_every must be a multiple of the other; got {self.every} and "
                f"{self.share_every}: {shown(longer // shorter * shorter)} goes with {shorter}"
            )
        readers = [text for text in self._readers if not text.startswith("weights")]
        if readers and self.share_interval % self.every:
            raise ParameterError(
                f"share_every must be a multiple of every where {' and '.join(readers)} reads the factors of a "
                f"decomposition, which is made every {self.every} episodes; got {self.share_every}"
            )

    @property
    def share_interval(self) -> int:
        """Episodes from one sharing to the next."""
        return self.every if self.share_every is None else self.share_every

    @property
    def interval(self) -> int:
        """Episodes from one step to the next: weights may change then, or tables be shared, or both."""
        return min(self.every, self.share_interval)

    @property
    def weighting(self) -> Weighting:
        """The strategy that `weights` names."""
        return WEIGHTINGS[self.weights] if isinstance(self.weights, str) else custom_weighting(self.weights)

    @property
    def sharing(self) -> SharingRule:
        """The rule that `share` names."""
        if isinstance(self.share, str):
            return SHARING_RULES[self.share]
        are_known = self.ranks is not None and self.share_interval % self.every == 0
        return custom_sharing(self.share, reads_norms=are_known)

    @property
    def needs_decomposition(self) -> bool:
        """Whether anything reads the factors: the constant control without sharing, for one, does not."""
        return bool(self._readers)

    @property
    def _readers(self) -> list[str]:
        """What reads the factors, in words."""
        named = (("weights", self.weights, self.weighting), ("share", self.share, self.sharing))
        readers = [f"{name}={shown(value)}" for name, value, rule in named if rule.needs_decomposition]
        return [*readers, f"shrink={self.shrink:g}"] if self.shrink > 0.0 else readers

    def logged_episodes(self, n_agents: int) -> int:
        """Return of how many episodes the changes are kept, for something to read them; 0 if nothing does."""
        of_sharing = self.share_interval if self.sharing.needs_changes and n_agents > 1 else 0
        return max(of_sharing, self.every if self.needs_decomposition else 0)


_EXPECTED_RANKS = "four whole numbers of at least 1, for the state, action, episode and agent axes"
_RANKS = [f"the {axis} rank" for axis in ("state", "action", "episode", "agent")]
