"""Makes environments: by name, Gymnasium's, else PettingZoo's, or by a callable."""

from collections.abc import Callable, Mapping
from functools import partial
from importlib import import_module
from types import MappingProxyType
from typing import Any, Protocol, cast

import gymnasium
import pettingzoo

from tuckerl.checks import check_function, check_name, shown
from tuckerl.errors import ParameterError, ParameterTypeError, ProblemError, TuckerlError, UnknownNameError, warn

GymEnvironment = gymnasium.Env[Any, Any]


class ParallelEnvironment(Protocol):
    """A PettingZoo parallel environment.

    PettingZoo's own class would do, but it is `Any` to the type checker, and a union with that checks nothing.
    """

    possible_agents: Any

    def close(self) -> None:
        """Let go of what the environment holds."""


Made = GymEnvironment | ParallelEnvironment


_MAKER = "a callable that makes environments"


def maker_of(env: Any) -> Callable[[], Any] | None:
    """Return what makes environments where `env` is an id or a callable; None where it is anything else.

    Raises
    ------
    ParameterError
        If it is a callable that cannot be called without arguments.
    """
    if isinstance(env, str):
        return partial(make_environment, env)
    if not callable(env) or isinstance(env, (gymnasium.Env, pettingzoo.ParallelEnv)):
        return None
    check_function(_MAKER, env, "")
    make: Callable[[], Any] = env
    return make


def made_of(env: Any, name: str) -> tuple[Any, Callable[[], Any] | None]:
    """Return an environment, and what made it where `env` is an id or a callable.

    Parameters
    ----------
    env
        What a user gave: an environment, an id or a callable.
    name : str
        What messages call that.

    Raises
    ------
    ParameterTypeError
        If there is no environment.
    ParameterError
        If a callable cannot be called without arguments.
    ProblemError
        If it has no spaces.
    """
    make = maker_of(env)
    try:
        made = env if make is None else make()
    except TypeError as error:
        if error.__traceback__ is not None and error.__traceback__.tb_next is not None:
            raise  # from inside of it
        raise ParameterError(f"{_MAKER} must take (); got {shown(env)}: {error}") from error
    if isinstance(made, (gymnasium.Env, pettingzoo.ParallelEnv)):
        check_spaces(made)
        return made, make
    hint = way_out(made)
    if make is not None:
        raise ParameterTypeError(
            "the callable must make a Gymnasium environment or a PettingZoo parallel environment; it made "
            f"{shown(made)}{hint}"
        )
    raise ParameterTypeError(
        f"{name} must be a Gymnasium environment, a PettingZoo parallel environment, the id of one, a callable that "
        f"makes one, a TabularMDP, a Simulator or a Maze; got {shown(env)}{hint}"
    )


def check_spaces(env: GymEnvironment) -> None:
    """Refuse an environment that has not set its spaces.

    Raises
    ------
    ProblemError
        If that is so.
    """
    for space in ("observation_space", "action_space"):
        if not hasattr(env, space):
            raise ProblemError(f"{type(env).__name__} has no {space}: set it in the environment's constructor")


TURNS = (
    "pettingzoo.utils.aec_to_parallel makes a parallel environment of it, or turn_based_aec_to_parallel where only one "
    "agent acts at a time"
)


def way_out(made: Any) -> str:
    """Return what to do with an environment of another kind, as the end of a sentence."""
    if isinstance(made, pettingzoo.AECEnv):
        return f", which moves agent by agent: {TURNS}"
    if isinstance(made, gymnasium.vector.VectorEnv) or hasattr(made, "num_envs"):
        return ", a vector environment: pass the id of a single one, or what makes it, and n_agents for several"
    if any(kind.__module__.partition(".")[0] == "gym" for kind in type(made).__mro__):
        return ", of the older package gym: shimmy's gymnasium.make('GymV26Environment-v0', env=env) makes it one"
    return ""


def close(env: Any, source: str) -> None:
    """Close an environment; one that fails to is warned of and costs nothing that was played in it."""
    try:
        env.close()
    except Exception as error:  # noqa: BLE001  # whatever an environment raises
        warn(f"{source} failed to close ({type(error).__name__}: {error}); results are not affected", ResourceWarning)


def name_of(env: Any) -> str:
    """Return what an environment is called in messages: its id, or its class."""
    return str(getattr(getattr(env, "spec", None), "id", None) or type(env.unwrapped).__name__)


def _tail(name: str) -> str:
    """Return what is the same in classic/rps-v2 and rps_v2, as PettingZoo's modules are called."""
    return name.rpartition("/")[2].replace("_", "-")


def make_environment(name: str, keywords: Mapping[str, Any] = MappingProxyType({})) -> Made:
    """Return a new environment; "module:id" imports what registers the id first.

    Parameters
    ----------
    name : str
        Gymnasium's id, or else PettingZoo's of a parallel environment.
    keywords : mapping, optional
        What the environment's own constructor takes.

    Raises
    ------
    UnknownNameError
        If there is no such module or id.
    ProblemError
        If the environment cannot be made so.
    """
    module, _, plain = name.rpartition(":")
    if module:
        try:
            import_module(module)
        except ModuleNotFoundError as error:
            if not f"{module}.".startswith(f"{error.name}."):
                raise ProblemError(
                    f"cannot make {name}: its module {module} imports {error.name}, which is not installed: install it"
                ) from error
            raise UnknownNameError(
                f"unknown environment {shown(name)}: there is no module {shown(module)} to import"
            ) from error
    known = {*gymnasium.registry, *pettingzoo.parallel_registry}
    if plain in pettingzoo.aec_registry and plain not in known:
        raise ProblemError(f"{plain} moves agent by agent, and learners play a parallel environment: {TURNS}")
    # Misspelt ones are put right to those that move agent by agent, too, of which the way out is told then.
    known |= pettingzoo.aec_registry.keys()
    tails = {_tail(one): one for one in sorted(known)}
    meant = tails.get(_tail(plain))
    if plain not in known and meant is not None:
        raise UnknownNameError(f"unknown environment {shown(plain)}: did you mean {meant!r}?")
    check_name("environment", plain, known, "; `tuckerl list environments` shows some of them")
    try:
        if plain in gymnasium.registry:
            return gymnasium.make(plain, disable_env_checker=True, **keywords)
        return cast("Made", pettingzoo.make("parallel", plain, **keywords))
    except TuckerlError:
        raise
    except Exception as error:
        given = ", ".join(f"{key}={shown(value)}" for key, value in keywords.items())
        reason = (str(error).strip() or type(error).__name__).splitlines()[0]
        raise ProblemError(f"cannot make {name}{f' with {given}' if given else ''}: {reason:.200}") from error
