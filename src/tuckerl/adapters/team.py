"""The agents of a joint problem: their observations, masks and actions by name are those of one joint table."""

from collections.abc import Mapping
from typing import Any

from tuckerl.adapters.masks import MaskReader
from tuckerl.adapters.python_problem import AgentSpaces
from tuckerl.checks import shown
from tuckerl.errors import ObservationError
from tuckerl.problems.problem import Choose


class Team:
    """Who acts together in a joint problem.

    Parameters
    ----------
    spaces : AgentSpaces
        Of the joint observations and actions, which are tuples of the agents'.
    readers : mapping of MaskReader by agent
        In the order of the tuples.

    Attributes
    ----------
    agents : tuple
    spaces : AgentSpaces
    """

    def __init__(self, spaces: AgentSpaces, readers: Mapping[Any, MaskReader]) -> None:
        self.spaces, self._readers = spaces, dict(readers)
        self.agents = tuple(self._readers)

    def decide(self, observation: Mapping[Any, Any], choose: Choose, action_masks: Any = None) -> dict[Any, Any]:
        """Return by agent the actions that are chosen for a dict of observations; see `Problem.decide`.

        Raises
        ------
        ObservationError
            If an agent's observation is missing or none of the environment's, or so with the masks.
        """
        missing = [name for name in self.agents if name not in observation]
        if missing:
            raise ObservationError(
                f"observations must have one of each agent, {', '.join(map(str, self.agents))}; {missing[0]} has none: "
                "for one that has left, give its last"
            )
        parts = [reader.take_apart(observation[name]) for name, reader in self._readers.items()]
        joint, carried = (tuple(both) for both in zip(*parts, strict=True))
        actions = self.spaces.decide(joint, 0, choose, carried, self._in_order(action_masks))
        return dict(zip(self.agents, actions, strict=True))

    def _in_order(self, action_masks: Any) -> Any:
        """Return masks by agent as a tuple, None for who has none; a tuple is one already."""
        if not isinstance(action_masks, Mapping):
            return action_masks
        unknown = [name for name in action_masks if name not in self.agents]
        if unknown:
            known = ", ".join(map(str, self.agents))
            raise ObservationError(f"action_masks must be a dict by agent, of {known}; got {shown(action_masks)}")
        return tuple(action_masks.get(name) for name in self.agents)
