"""Cart pole line by line, from the equations of Barto, Sutton and Anderson (1983) and the written grid and rewards."""

import math

State = tuple[float, float, float, float]
DEFAULTS = {
    "force": 10.0,
    "gravity": 9.8,
    "cart_mass": 1.0,
    "pole_mass": 0.1,
    "half_length": 0.5,
    "time_step": 0.02,
    "track": 4.0,
    "fall": 45.0,
}
ACTIONS = [round(-1 + k / 10, 1) for k in range(21)]


def move(state: State, action: int, p: dict[str, float]) -> State:
    x, x_dot, theta, theta_dot = state
    force = p["force"] * ACTIONS[action]
    total_mass = p["cart_mass"] + p["pole_mass"]
    polemass_length = p["pole_mass"] * p["half_length"]
    temp = (force + polemass_length * theta_dot**2 * math.sin(theta)) / total_mass
    theta_acc = (p["gravity"] * math.sin(theta) - math.cos(theta) * temp) / (
        p["half_length"] * (4 / 3 - p["pole_mass"] * math.cos(theta) ** 2 / total_mass)
    )
    x_acc = temp - polemass_length * theta_acc * math.cos(theta) / total_mass
    tau = p["time_step"]
    return x + tau * x_dot, x_dot + tau * x_acc, theta + tau * theta_dot, theta_dot + tau * theta_acc


def fallen(state: State, p: dict[str, float]) -> bool:
    return abs(state[2]) > p["fall"] * math.pi / 180


def off_track(state: State, p: dict[str, float]) -> bool:
    return abs(state[0]) > p["track"]


def shaped(state: State, p: dict[str, float]) -> float:
    x, _, theta, theta_dot = state
    if fallen(state, p) or off_track(state, p):
        return -10000 - 50 * abs(x) - 100 * abs(theta)
    return 10 - 10 * abs(10 * theta) ** 2 - 5 * abs(x) - 10 * theta_dot


def sign_reward(state: State, p: dict[str, float]) -> float:
    return -1 if fallen(state, p) or off_track(state, p) else 1


def sign(number: float) -> int:
    return (number > 0) - (number < 0)


def nearest(number: float, grid: list[int]) -> int:
    distances = [abs(number - point) for point in grid]
    return distances.index(min(distances))  # the first on a tie


def row(state: State, p: dict[str, float]) -> int:
    if fallen(state, p):
        return 108
    if off_track(state, p):
        return 109
    x, x_dot, theta, theta_dot = state
    i = nearest(sign(x), [-1, 1])
    j = nearest(sign(x_dot), [-1, 0, 1])
    k = nearest(math.degrees(theta), [-12, -9, -6, -3, 0, 3, 6, 9, 12])
    m = nearest(sign(theta_dot), [-1, 1])
    return ((i * 3 + j) * 9 + k) * 2 + m
