"""Answers to what users of neighbouring libraries type: the word that is used here."""

from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from inspect import Parameter, signature
from typing import ParamSpec, TypeVar

from tuckerl.checks import did_you_mean, shown
from tuckerl.errors import ParameterTypeError

P = ParamSpec("P")
R = TypeVar("R")

_CALLBACKS = "use callbacks=[...], a sequence"
_EPISODES = "use episodes=..."
_EPSILON = "use epsilon=..., a number or a schedule such as tuckerl.Linear(1.0, 0.05, episodes=500)"
_COPIES = "use n_agents=..., each in a copy of its own"
_WATCH = "use callbacks=[tuckerl.TensorBoard(...)] of learn()"
_VERBOSE = "use progress=True of learn()"

HABITS: Mapping[str, Mapping[str, str]] = {
    "learn": {
        "total_timesteps": "use steps=..., which finishes its last episode, or episodes=...",
        "n_steps": "use steps=..., which finishes its last episode, or episodes=...",
        "n_timesteps": "use steps=..., which finishes its last episode, or episodes=...",
        "n_episodes": _EPISODES,
        "num_episodes": _EPISODES,
        "progress_bar": "use progress=True",
        "verbose": "use progress=True",
        "callback": _CALLBACKS,
        "log_interval": "use callbacks=[tuckerl.CsvLog(...)], whose every=... counts episodes",
        "tb_log_name": "use callbacks=[tuckerl.TensorBoard(...)]",
        "reset_num_timesteps": "leave it out: learning always goes on, and a new learner begins anew",
        "eval_env": "use callbacks=[tuckerl.Evaluate(...)]",
    },
    "predict": {
        "obs": "use observation",
        "action_mask": "use action_masks=...",
        "mask": "use action_masks=...",
        "mask_actions": "use action_masks=...",
    },
    "evaluate": {
        "n_eval_episodes": _EPISODES,
        "n_episodes": _EPISODES,
        "num_episodes": _EPISODES,
        "eval_env": "use env=...",
        "return_episode_rewards": "leave it out: the result always has all returns",
        "callback": "leave it out: the result always has all returns and steps",
        "warn": "leave it out",
    },
    "constructor": {
        "learning_rate": "use alpha=...",
        "lr": "use alpha=...",
        "discount": "use gamma=...",
        "discount_factor": "use gamma=...",
        "exploration_rate": _EPSILON,
        "exploration_fraction": _EPSILON,
        "exploration_initial_eps": _EPSILON,
        "exploration_final_eps": _EPSILON,
        "eps": _EPSILON,
        "num_envs": _COPIES,
        "n_envs": _COPIES,
        "tensorboard_log": _WATCH,
        "verbose": _VERBOSE,
        "progress_bar": _VERBOSE,
        "total_timesteps": "use steps=... of learn()",
        "policy_kwargs": "leave it out: there is no network",
        "device": "leave it out: there is no network",
    },
}
"""What is answered to a keyword that is used elsewhere, by what was called."""


def answering_habits(function: Callable[P, R]) -> Callable[P, R]:
    """Return a method that answers keywords which it does not have with the word to use; its signature stays.

    The method raises `ParameterTypeError` for such a keyword.
    """
    known = [name for name in signature(function).parameters if name != "self"]
    name = function.__name__

    @wraps(function)
    def answering(*arguments: P.args, **keywords: P.kwargs) -> R:
        for unknown in keywords:
            if unknown not in known:
                raise ParameterTypeError(
                    f"{name}() has no argument {shown(unknown)}: {word_to_use(name, unknown, known)}"
                )
        return function(*arguments, **keywords)

    return answering


def word_to_use(called: str, keyword: str, known: Sequence[str]) -> str:
    """Return what to write instead of a keyword that nothing here has.

    Parameters
    ----------
    called : str
        A key of `HABITS`.
    keyword : str
    known : sequence of str
        The keywords that there are.
    """
    habit = HABITS.get(called, {}).get(keyword)
    return habit or did_you_mean(keyword, known) or f"it takes {', '.join(known)}"


def check_positions(learner: type, arguments: Sequence[object]) -> None:
    """Refuse more than an environment by position, as in ``DQN("MlpPolicy", env)``.

    Raises
    ------
    ParameterTypeError
        If there is more.
    """
    parameters = list(signature(learner).parameters.values())
    positional = [p for p in parameters if p.kind in (Parameter.POSITIONAL_ONLY, Parameter.POSITIONAL_OR_KEYWORD)]
    is_open = any(p.kind is Parameter.VAR_POSITIONAL for p in parameters)
    if len(arguments) > len(positional) and not is_open:
        names = ", ".join(p.name for p in positional)
        raise ParameterTypeError(
            f"{learner.__name__} takes {names} by position and all else by keyword, such as policy=...; "
            f"got {len(arguments)} arguments"
        )
