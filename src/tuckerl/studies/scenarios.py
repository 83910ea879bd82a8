"""All scenarios by name. To add one, write its file and list it here."""

from tuckerl.checks import check_int, check_name
from tuckerl.registers import load
from tuckerl.studies.study import Scenario, Study

_LISTED = (
    "tuckerl.studies.cart_pole:CART_POLE",
    "tuckerl.studies.dyna_maze:DYNA_MAZE",
    "tuckerl.studies.robot_rescue:ROBOT_RESCUE",
)

SCENARIOS: dict[str, Scenario] = {scenario.name: scenario for scenario in map(load, _LISTED)}

QUICK_INSTANCES, QUICK_RUNS, QUICK_EPISODES = 2, 5, 50


def scenario_study(
    scenario: str = "all", *, runs: int | None = None, episodes: int | None = None, seed: int = 0, quick: bool = False
) -> Study:
    """Return the study of one scenario or of all.

    Parameters
    ----------
    scenario : str
        A scenario's name or ``"all"``.
    runs, episodes : int, optional
        Other numbers than the scenario's own.
    seed : int
    quick : bool
        A small version of everything: few instances, runs and episodes.

    Raises
    ------
    UnknownNameError, ParameterError, ParameterTypeError
        If a scenario is unknown or a number impossible.
    """
    check_name("scenario", scenario, [*SCENARIOS, "all"])
    chosen = tuple(SCENARIOS.values()) if scenario == "all" else (SCENARIOS[scenario],)
    if quick:
        chosen = tuple(
            s.resized(min(s.n_instances, QUICK_INSTANCES), QUICK_RUNS, min(s.n_episodes, QUICK_EPISODES))
            for s in chosen
        )
    return Study(tuple(s.resized(None, runs, episodes) for s in chosen), check_int("seed", seed, 0))
