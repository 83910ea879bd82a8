"""Checks of what must come out alike: seeds, parts, files, agents, and two ways to play one problem."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from tuckerl.adapters.resolve import Environment
from tuckerl.errors import LearnerCheckError
from tuckerl.testing.small_problems import corridor, drift, slippery, stepped_corridor
from tuckerl.testing.subject import EVERY, Subject, check_same

_FIRST, _MORE = 2 * EVERY + 3, EVERY  # the first part ends within a window
_KEEP = (
    "what the algorithm keeps beside its Q-table must be an array that declare_state returns, not one that constants "
    "makes anew"
)
_STREAM = "draw by tuckerl.rng.uniform(agent.rng) and below(n, agent.rng), from nothing else"
_SEED = f"{_STREAM}, and keep nothing in the class or the module"


def check_repeats(subject: Subject, env: Environment | None) -> None:
    """Check that equal things come out equal, for one agent and several, with a tensor step and without."""
    own = [] if env is None else [env]
    _check_seeds(subject)
    _check_agents(subject)
    for problem in (slippery(), drift(), *own):
        several = 1 if subject.on(problem).problem.shares_world else 3
        for n_agents, step in ((1, None), (several, subject.tensor_step())):
            settings = {"n_agents": n_agents, "tensor_step": step}
            learners = [subject.on(problem, **settings).learn(_FIRST) for _ in range(2)]
            check_same(learners[0], learners[1], f"two of {subject.name} with the same seed must learn the same", _SEED)
            _check_parts(subject, problem, settings)
    _check_stepped(subject)


def _check_seeds(subject: Subject) -> None:
    """Check that the same seed gives the same tables, and another one others."""
    one, two, other = (subject.on(slippery(), seed=seed).learn(_FIRST) for seed in (0, 0, 1))
    check_same(one, two, f"two of {subject.name} with the same seed must learn the same", _SEED)
    if np.array_equal(one.q, other.q):
        raise LearnerCheckError(
            f"seeds must decide what {subject.name} does; with the seeds 0 and 1 it learned the same on a slippery "
            "floor: pass all keywords on, super().__init__(env, **parameters)"
        )


def _check_parts(subject: Subject, problem: Any, settings: dict[str, Any]) -> None:
    """Check that learning in two parts equals learning at once, a file between them or not."""
    whole = subject.on(problem, **settings).learn(_FIRST + _MORE)
    parts = subject.on(problem, **settings).learn(_FIRST)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "learner.tuckerl"
        parts.save(path)
        try:
            loaded = subject.learner_class.load(path, env=None if parts.problem.is_data else problem)
        except Exception as error:  # whatever the learner's own part of it raises
            raise LearnerCheckError(
                f"{subject.name}.load must read what save wrote; it raised {type(error).__name__}: {error}: keep the "
                "constructor's parameters as attributes of the same names, and declare arrays in declare_state"
            ) from error
    parts.learn(_MORE)
    what = f"learning {_FIRST} and then {_MORE} episodes must equal learning {_FIRST + _MORE}"
    check_same(whole, parts, f"{what}, with {settings['n_agents']} of {subject.name}", _KEEP)
    loaded.learn(_MORE)
    what = f"a {subject.name} that was saved and loaded must go on as if it had not been"
    check_same(whole, loaded, what, _KEEP)


def _check_agents(subject: Subject) -> None:
    """Check that an agent does not know how many others there are, but that no two are alike."""
    two, three = (subject.on(slippery(), n_agents=n) for n in (2, 3))
    for _ in range(_FIRST):  # one by one, so that agents take turns
        two.learn(1)
        three.learn(1)
    if not np.array_equal(two.q, three.q[:2]):
        table = int(np.argmax([(two.q[i] != three.q[i]).any() for i in range(2)]))
        raise LearnerCheckError(
            f"agents must not depend on how many there are; agent {table} of {subject.name} learned something else "
            "beside two others than beside one: declare in declare_state what an agent "
            "keeps, so that each has its own"
        )
    if np.array_equal(three.q[0], three.q[1]):
        raise LearnerCheckError(f"two agents of {subject.name} learned the same by chance: {_STREAM}")


def _check_stepped(subject: Subject) -> None:
    """Check that a problem stepped in Python gives the same tables as its arrays."""
    arrays, stepped = (subject.on(problem).learn(_FIRST) for problem in (corridor(), stepped_corridor()))
    what = f"{subject.name} must learn the same from a corridor's arrays as from the corridor stepped in Python"
    check_same(arrays, stepped, what, "kernels must not look at how large a world is or where it comes from")
