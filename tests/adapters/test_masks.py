"""Action masks: where they may be, what they may look like, and what is refused."""

import copy
import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, MultiDiscrete, Tuple

from tests.adapters.parallel_worlds import Masked
from tuckerl.adapters.joint import JointEnv
from tuckerl.adapters.masks import MaskReader, observation_part
from tuckerl.errors import ObservationError, SpaceError

CLASSIC = Dict({"observation": Discrete(9), "action_mask": MultiBinary(3)})


@pytest.mark.parametrize(
    "space",
    [
        Discrete(4),
        Dict({"observation": Discrete(4)}),
        Dict({"observation": Discrete(4), "action_mask": MultiBinary(3), "clock": Discrete(2)}),
        Tuple([CLASSIC]),
    ],
    ids=str,
)
def test_a_space_without_a_mask_is_all_observation(space: Any) -> None:
    assert observation_part(space) is space


def test_a_space_of_observation_and_mask_is_taken_apart() -> None:
    assert observation_part(CLASSIC) is CLASSIC["observation"]
    assert MaskReader(CLASSIC, Discrete(3)).observation_space == Discrete(9)


@pytest.mark.parametrize("given", [[1, 0, 1], np.array([1, 0, 1], np.int8), (True, False, True), np.array([1.0, 0, 1])])
def test_a_mask_in_the_info_is_read(given: Any) -> None:
    observation, mask = MaskReader(Discrete(9), Discrete(3, start=-1))(7, {"action_mask": given, "other": 1})
    assert observation == 7
    assert mask is not None
    assert mask.dtype == np.bool_
    assert mask.tolist() == [True, False, True]


def test_a_mask_in_the_observation_is_read_and_goes_before_the_infos() -> None:
    read = MaskReader(CLASSIC, Discrete(3))
    given = {"observation": 4, "action_mask": np.array([0, 0, 1], np.int8)}
    for info in ({}, {"action_mask": [1, 1, 1]}):
        observation, mask = read(given, info)
        assert observation == 4
        assert mask is not None
        assert mask.tolist() == [False, False, True]


def test_without_a_mask_nothing_changes() -> None:
    observation = np.array([1, 2])
    for info in ({}, {"action_mask": None}):
        kept, mask = MaskReader(MultiDiscrete([3, 3]), Box(-1, 1, (2,)))(observation, info)
        assert kept is observation
        assert mask is None


def test_a_mask_that_allows_nothing_allows_everything() -> None:
    _, mask = MaskReader(Discrete(9), Discrete(3))(0, {"action_mask": [0, 0, 0]})
    assert mask is not None
    assert mask.tolist() == [True, True, True]


def test_the_mask_is_a_copy() -> None:
    given = np.array([True, False, True])
    _, mask = MaskReader(Discrete(9), Discrete(3))(0, {"action_mask": given})
    assert mask is not None
    mask[:] = False
    assert given.tolist() == [True, False, True]


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (([1, 0], [0, 1, 1]), [0, 1, 1, 0, 0, 0]),  # first * 3 + second
        ((None, [0, 1, 1]), [0, 1, 1, 0, 1, 1]),
        (([0, 1], None), [0, 0, 0, 1, 1, 1]),
        (([0, 0], [0, 0, 1]), [0, 0, 1, 0, 0, 1]),  # nothing allowed: that part is free
        ((np.array([0, 1], np.int8), np.array([1, 0, 0], np.int8)), [0, 0, 0, 1, 0, 0]),
    ],
)
def test_joint_masks_are_numbered_in_c_order(given: Any, expected: list[int]) -> None:
    _, mask = MaskReader(Discrete(9), Tuple([Discrete(2), Discrete(3)]))(0, {"action_mask": given})
    assert mask is not None
    assert mask.astype(int).tolist() == expected


def test_a_joint_mask_of_three_parts_equals_its_definition() -> None:
    parts = [[1, 0, 1], [0, 1], [1, 1, 0, 1]]
    _, mask = MaskReader(Discrete(9), Tuple([Discrete(3), Discrete(2), Discrete(4)]))(0, {"action_mask": tuple(parts)})
    assert mask is not None
    for joint, allowed in enumerate(mask):
        own = np.unravel_index(joint, (3, 2, 4))
        assert allowed == all(part[action] for part, action in zip(parts, own, strict=True))


def test_a_joint_mask_without_parts_is_none() -> None:
    assert MaskReader(Discrete(9), Tuple([Discrete(2), Discrete(3)]))(0, {"action_mask": (None, None)}) == (0, None)


def test_taxi_is_read() -> None:
    env = gymnasium.make("Taxi-v4")
    read = MaskReader(env.observation_space, env.action_space)
    state, info = env.reset(seed=3)
    assert read(state, info)[0] == state
    mask = read(state, info)[1]
    assert mask is not None
    assert mask.tolist() == [bool(entry) for entry in info["action_mask"]]
    assert not mask.all()


def test_a_joint_environment_is_read() -> None:
    env = JointEnv(Masked())
    read = MaskReader(env.observation_space, env.action_space)
    _, mask = read(*env.reset())  # first may not take 0, second may not take 1
    assert mask is not None
    assert np.flatnonzero(mask).tolist() == [3, 5, 6, 8]


@pytest.mark.parametrize(
    "given", [[1, 0], [1, 0, 1, 1], [[1, 0, 1]], 1, "101", ["a", "b", "c"], [[1], [1, 0], []], {"a": 1}], ids=str
)
def test_masks_of_another_form_are_refused(given: Any) -> None:
    message = "an action mask must be a row of 3 entries, 1 where an action may be taken and 0 where not; got"
    with pytest.raises(ObservationError, match=message):
        MaskReader(Discrete(9), Discrete(3))(0, {"action_mask": given})
    with pytest.raises(ObservationError, match=message):
        MaskReader(CLASSIC, Discrete(3))({"observation": 0, "action_mask": given}, {})


@pytest.mark.parametrize("given", [[1, 0, 2], [-1, 0, 1], [0.5, 0, 1], [np.nan, 0, 1]], ids=str)
def test_masks_of_other_entries_are_refused(given: Any) -> None:
    with pytest.raises(ObservationError, match=r"the entries of an action mask must be 0 or 1; got \["):
        MaskReader(Discrete(9), Discrete(3))(0, {"action_mask": given})


@pytest.mark.parametrize("given", [[1, 0, 1, 1, 0, 1], ([1, 0],), ([1, 0], [1, 1, 1], [1]), np.ones(2), 1], ids=str)
def test_joint_masks_of_another_form_are_refused(given: Any) -> None:
    read = MaskReader(Discrete(9), Tuple([Discrete(2), Discrete(3)]))
    with pytest.raises(ObservationError, match="action mask must be a tuple of 2 masks; got"):
        read(0, {"action_mask": given})


@pytest.mark.parametrize("observation", [3, {"observation": 3}, {"action_mask": [1, 1, 1]}, None], ids=str)
def test_observations_without_their_mask_are_refused(observation: Any) -> None:
    with pytest.raises(ObservationError, match="must be a dict of 'observation' and 'action_mask', as its space says"):
        MaskReader(CLASSIC, Discrete(3))(observation, {})


@pytest.mark.parametrize(
    "space", [Box(-1, 1, (3,)), Tuple([Discrete(2), MultiBinary(2)]), Dict({"a": Discrete(2)})], ids=str
)
def test_actions_of_other_spaces_cannot_be_masked(space: Any) -> None:
    message = r"action masks must belong to an action space that is Discrete, .*; got one for"
    with pytest.raises(SpaceError, match=message):
        MaskReader(CLASSIC, space)
    read = MaskReader(Discrete(9), space)
    assert read(0, {}) == (0, None)
    with pytest.raises(SpaceError, match=message):
        read(0, {"action_mask": [1, 1, 1]})


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ([1, 0, 0, 1, 1], [0, 1, 1, 0, 0, 0]),  # of both dimensions in one row
        ([0, 0, 0, 0, 1], [0, 0, 1, 0, 0, 1]),  # nothing allowed of the first: it is free
        ([0, 1, 1, 0, 0, 0], [0, 1, 1, 0, 0, 0]),  # of the joint actions
        (([1, 0], [0, 1, 1]), [0, 1, 1, 0, 0, 0]),
        ((None, [0, 1, 1]), [0, 1, 1, 0, 1, 1]),
    ],
    ids=str,
)
def test_masks_of_several_dimensions_are_numbered_in_c_order(given: Any, expected: list[int]) -> None:
    _, mask = MaskReader(Discrete(9), MultiDiscrete([2, 3]))(0, {"action_mask": given})
    assert mask is not None
    assert mask.astype(int).tolist() == expected


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda read: pickle.loads(pickle.dumps(read))])  # noqa: S301
def test_readers_can_be_copied(duplicate: Any) -> None:
    _, mask = duplicate(MaskReader(CLASSIC, Discrete(3)))({"observation": 4, "action_mask": [0, 1, 0]}, {})
    assert mask.tolist() == [False, True, False]


def test_a_number_that_python_does_not_write_is_refused_as_any_other() -> None:
    with pytest.raises(ObservationError, match=r"an action mask must be a row of 3 entries.*; got about 10\^5000"):
        MaskReader(Discrete(5), Discrete(3))(0, {"action_mask": 10**5000})
