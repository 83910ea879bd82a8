r"""Cart pole (the paper's section IV.A, Figure 9): push a cart left or right so that the pole on it stays up.

The state is (x, x', theta, theta'): the cart's place in m and its speed, the pole's angle from upright in radians and
its rate; positive is right and clockwise. With force F, masses M and m of cart and pole, the pole's share
mu = m / (M + m) of the mass and half its length l,

.. math:: u = \frac{F}{M + m} + \mu l \theta'^2 \sin\theta, \qquad
          \theta'' = \frac{g \sin\theta - u \cos\theta}{l\,(4/3 - \mu \cos^2\theta)}, \qquad
          x'' = u - \mu l\,\theta'' \cos\theta

(Barto, Sutton and Anderson, IEEE Transactions on Systems, Man, and Cybernetics 13, 1983), in Euler steps that move the
positions by the old speeds. Grid, rewards and start are those of J. A. Martin H.'s SARSA demonstration.
"""

import math
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded

from tuckerl.checks import check_flag, check_name, check_real, shown
from tuckerl.environments.cart_pole_view import draw_cart_pole, write_cart_pole
from tuckerl.environments.raster import RENDER_MODES, check_render_mode, rendered
from tuckerl.errors import ParameterError
from tuckerl.problems.simulator import Simulator
from tuckerl.rng import uniform
from tuckerl.types import FloatArray, Stream

N_ACTIONS = 21
N_STATES = 110
FALLEN, OFF_TRACK = 108, 109
"""The rows of the two ways to fail; a pole that falls as the cart leaves the track has fallen."""
NO_FORCE = 10
"""The action in the middle: action a pushes with (a - 10) / 10 of the full force."""
MAX_EPISODE_STEPS = 1000
UNIFORM_START = 0.05

# The simulator's parameters.
GRAVITY, CART_MASS, POLE_MASS, HALF_LENGTH, TIME_STEP, FORCE, TRACK, FALL, SHAPED, START, ABSORBING = range(11)


# Compiled and interpreted arithmetic agree to the last bit: products are written out, no `**`.
def reset(parameters: FloatArray, state: FloatArray, rng: Stream) -> None:
    """Begin at (0, 0, 0, 0.01), or anywhere within START of 0.

    Parameters
    ----------
    parameters : (11,) float64
        By the names above: GRAVITY, CART_MASS, ...
    state : (4,) float64
        Set to the first x, x', theta and theta'.
    rng : (4,) uint64
        The stream; advanced by four draws where the start is uniform.
    """
    spread = parameters[START]
    if spread > 0.0:
        for i in range(4):
            state[i] = spread * (2.0 * uniform(rng) - 1.0)
    else:
        state[:] = 0.0
        state[3] = 0.01


def step(parameters: FloatArray, state: FloatArray, action: int, rng: Stream) -> tuple[float, bool]:
    """Push for one time step; return the new state's reward and whether it is a failure.

    Parameters
    ----------
    parameters : (11,) float64
    state : (4,) float64
        Moved from one x, x', theta and theta' to the next.
    action : int
    rng : (4,) uint64
        Unused: nothing is random.
    """
    x, speed, angle, rate = float(state[0]), float(state[1]), float(state[2]), float(state[3])
    half_length, time_step = parameters[HALF_LENGTH], parameters[TIME_STEP]
    # What depends on the parameters alone is divided first: one division waits for the state, not four.
    mass = parameters[CART_MASS] + parameters[POLE_MASS]
    share = parameters[POLE_MASS] / mass
    sine, cosine = math.sin(angle), math.cos(angle)
    push = parameters[FORCE] * (action - NO_FORCE) / (10.0 * mass) + share * half_length * rate * rate * sine
    turn = (parameters[GRAVITY] * sine - push * cosine) / (half_length * (4.0 / 3.0 - share * cosine * cosine))
    x += time_step * speed
    speed += time_step * (push - share * half_length * turn * cosine)
    angle += time_step * rate
    rate += time_step * turn
    state[0], state[1], state[2], state[3] = x, speed, angle, rate
    failed = abs(x) > parameters[TRACK] or abs(angle) > parameters[FALL]
    if parameters[SHAPED] == 0.0:
        return (-1.0 if failed else 1.0), failed
    if failed:
        return -10000.0 - 50.0 * abs(x) - 100.0 * abs(angle), True
    return 10.0 - 10.0 * (10.0 * angle) * (10.0 * angle) - 5.0 * abs(x) - 10.0 * rate, False


def index(parameters: FloatArray, state: FloatArray) -> int:
    """Return the row of the grid's nearest point, the lower one on a tie; of a failure, its own row.

    Parameters
    ----------
    parameters : (11,) float64
    state : (4,) float64
        x, x', theta and theta'.
    """
    if parameters[ABSORBING] > 0.0:
        if abs(state[2]) > parameters[FALL]:
            return FALLEN
        if abs(state[0]) > parameters[TRACK]:
            return OFF_TRACK
    x, rate = int(state[0] > 0.0), int(state[3] > 0.0)
    speed = 1 + int(state[1] > 0.0) - int(state[1] < 0.0)
    degrees = state[2] * (180.0 / math.pi)
    angle = 0
    for i in range(8):  # how many of the middles between -12, -9, ..., 12 lie below
        angle += int(degrees > -10.5 + 3.0 * i)
    return ((x * 3 + speed) * 9 + angle) * 2 + rate


def cart_pole(
    *,
    reward: str = "shaped",
    start: str = "fixed",
    force: float = 10.0,
    gravity: float = 9.8,
    cart_mass: float = 1.0,
    pole_mass: float = 0.1,
    half_length: float = 0.5,
    time_step: float = 0.02,
    track: float = 4.0,
    fall: float = 45.0,
    absorbing: bool = True,
    max_episode_steps: int | None = MAX_EPISODE_STEPS,
) -> Simulator:
    """Return the cart pole as kernels play it: 110 states, 21 actions.

    Row ``((x * 3 + x') * 9 + theta) * 2 + theta'`` by grid index: x in (-1, 1), x' in (-1, 0, 1) and theta' in (-1, 1)
    by their signs (0 counts as -1 where there is no 0), theta in (-12, -9, ..., 12) degrees; the lower on a tie, and
    beyond the ends the last. Row 108 is *fallen*, 109 *off the track*.

    Parameters
    ----------
    reward : "shaped" or "sign"
        Of the new state: 10 - 10 (10 theta)^2 - 5 abs(x) - 10 theta', and -10000 - 50 abs(x) - 100 abs(theta) for a
        failure; or 1 and -1.
    start : "fixed" or "uniform"
        (0, 0, 0, 0.01), or each number uniform within 0.05 of 0.
    force : float
        What actions 0 and 20 push with, to the left and to the right, in N; those between are evenly spaced.
    gravity : float
        In m/s^2.
    cart_mass, pole_mass : float
        In kg.
    half_length : float
        Half the pole's length, in m.
    time_step : float
        In s.
    track : float
        The episode ends in failure when abs(x) is larger, in m ...
    fall : float
        ... or abs(theta) is, in degrees.
    absorbing : bool
        Whether a failure has a row of its own; otherwise it falls into the row of the grid's nearest point, which
        matters to learners that bootstrap from terminal states.
    max_episode_steps : int, optional

    Raises
    ------
    ParameterError, ParameterTypeError, UnknownNameError
        If a number is not finite or impossible, or a name is unknown.

    Examples
    --------
    >>> from tuckerl.environments.cart_pole import cart_pole
    >>> cart_pole(start="uniform")
    Simulator(tuckerl.environments.cart_pole, 110 states, 21 actions, max_episode_steps=1000)
    """
    check_name("reward", reward, ("shaped", "sign"))
    check_name("start", start, ("fixed", "uniform"))
    parameters = np.zeros(11)
    parameters[GRAVITY] = check_real("gravity", gravity, 0.0)
    parameters[CART_MASS] = check_real("cart_mass", cart_mass, 0.0, low_open=True)
    parameters[POLE_MASS] = check_real("pole_mass", pole_mass, 0.0, low_open=True)
    parameters[HALF_LENGTH] = check_real("half_length", half_length, 0.0, low_open=True)
    parameters[TIME_STEP] = check_real("time_step", time_step, 0.0, low_open=True)
    parameters[FORCE] = check_real("force", force, 0.0, low_open=True)
    parameters[TRACK] = check_real("track", track, 0.0, low_open=True)
    parameters[FALL] = math.radians(check_real("fall", fall, 0.0, 180.0, low_open=True))
    parameters[SHAPED] = reward == "shaped"
    parameters[ABSORBING] = check_flag("absorbing", absorbing)
    parameters[START] = UNIFORM_START if start == "uniform" else 0.0
    return Simulator(
        reset,
        step,
        index,
        n_states=N_STATES,
        n_actions=N_ACTIONS,
        state_size=4,
        parameters=parameters,
        max_episode_steps=max_episode_steps,
    )


class CartPoleEnv(gymnasium.Env[Any, Any]):
    """The cart pole under Gymnasium, ``tuckerl/CartPole-v0``.

    Parameters
    ----------
    discrete : bool, default True
        Observe the row of :func:`cart_pole`, Discrete(110); otherwise the four numbers, as float64.
    render_mode : {"ansi", "rgb_array"}, optional
        ``render`` returns a line of text or a (height, width, 3) uint8 image.
    **parameters
        Those of :func:`cart_pole`, without the time limit: ``gymnasium.make`` adds that.

    Attributes
    ----------
    simulator : Simulator or None
        What learners play; None without `discrete`, as there is no table for four numbers.

    Raises
    ------
    ParameterError, ParameterTypeError, UnknownNameError
        If a parameter is impossible.

    Examples
    --------
    >>> import gymnasium, tuckerl
    >>> env = gymnasium.make("tuckerl/CartPole-v0")
    >>> env.reset(seed=0)
    (27, {})
    >>> env.step(12)[0]
    44
    """

    metadata = {"render_modes": RENDER_MODES, "render_fps": 50}  # noqa: RUF012  # as Gymnasium types it

    def __init__(self, discrete: bool = True, render_mode: str | None = None, **parameters: Any) -> None:
        self.render_mode = check_render_mode(render_mode)
        self.discrete = check_flag("discrete", discrete)
        self._problem = cart_pole(**parameters, max_episode_steps=None)
        self.observation_space: gymnasium.Space[Any] = gymnasium.spaces.Discrete(N_STATES)
        if not self.discrete:
            # Nothing bounds the speeds, but a Box must be finite to draw samples from it evenly.
            largest = float(np.finfo(np.float32).max)
            self.observation_space = gymnasium.spaces.Box(-largest, largest, (4,), np.float64)
        self.action_space = gymnasium.spaces.Discrete(N_ACTIONS)
        self._state: FloatArray = np.zeros(4)
        self._stream: Stream | None = None  # None before the first reset
        self._push = 0.0

    @property
    def simulator(self) -> Simulator | None:
        """What ``step`` plays, whose states are the observations; None where these are the four numbers."""
        return self._problem if self.discrete else None

    def _observation(self) -> Any:
        if not self.discrete:
            return self._state.copy()
        return int(self._problem.functions.index(self._problem.parameters, self._state))

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Put cart and pole at their start; `seed` decides a uniform one, `options` change nothing."""
        super().reset(seed=seed)
        self._stream = self.np_random.integers(0, 2**64, size=4, dtype=np.uint64)
        self._problem.functions.reset(self._problem.parameters, self._state, self._stream)
        self._push = 0.0
        return self._observation(), {}

    def step(self, action: int) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Push with (action - 10) / 10 of the force for one time step.

        Raises
        ------
        ParameterError
            If there is no such action.
        """
        if self._stream is None:
            raise ResetNeeded("call reset() before step(): no episode has begun")
        if not self.action_space.contains(action):
            raise ParameterError(
                f"action must be from 0 (full force to the left) to 20 (to the right); got {shown(action)}"
            )
        self._push = (int(action) - NO_FORCE) / 10.0
        reward, failed = self._problem.functions.step(self._problem.parameters, self._state, int(action), self._stream)
        return self._observation(), float(reward), bool(failed), False, {}

    def render(self) -> Any:
        """Return the track, the cart, its pole and the push that led here, as `render_mode` asks."""
        state, push, parameters = self._state, self._push, self._problem.parameters
        return rendered(
            self.render_mode,
            lambda: write_cart_pole(state, parameters[TRACK], push * parameters[FORCE]),
            lambda: draw_cart_pole(state, parameters[TRACK], 2.0 * parameters[HALF_LENGTH], push),
        )
