"""How actions are chosen. To add a policy, write its file and list it in `POLICIES`."""

from typing import TYPE_CHECKING, NamedTuple

from tuckerl.checks import check_name
from tuckerl.registers import load

if TYPE_CHECKING:
    from tuckerl.training.policies.policy import Policy


class PolicyEntry(NamedTuple):
    """A policy in the register."""

    home: str
    description: str


POLICIES = {
    "EpsilonGreedy": PolicyEntry(
        f"{__name__}.epsilon_greedy", "a random action with probability epsilon, else a greedy one"
    ),
    "Greedy": PolicyEntry(f"{__name__}.greedy", "an action of the largest value"),
    "Softmax": PolicyEntry(f"{__name__}.softmax", "drawn by exp(Q / temperature)"),
    "UCB": PolicyEntry(f"{__name__}.ucb", "an action of the largest upper confidence bound, by counts of its choices"),
    "OwnDistribution": PolicyEntry(
        f"{__name__}.own_distribution", "drawn from the distribution that the algorithm learns"
    ),
}
"""The policies by the names of their classes."""


def policy_class(name: str) -> type["Policy"]:
    """Return the class of a registered policy.

    Raises
    ------
    UnknownNameError
        If there is none of this name.
    """
    entry = POLICIES[check_name("policy", name, POLICIES)]
    kind: type[Policy] = load(f"{entry.home}:{name}")
    return kind
