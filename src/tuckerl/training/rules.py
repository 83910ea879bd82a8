"""The rules by which a learner learns."""

from collections.abc import Mapping
from typing import NamedTuple

from tuckerl.training.agent_arrays import Settings
from tuckerl.training.declared_state import Declaration
from tuckerl.training.policies.policy import Policy
from tuckerl.training.schedules import Schedule


class Rules(NamedTuple):
    """How a learner learns, by those of its parameters that can change between episodes."""

    schedules: Mapping[str, Schedule]  # alpha first, then the algorithm's own; the policy's are added
    policy: Policy
    declarations: tuple[Declaration, ...]  # of the algorithm
    settings: Settings
