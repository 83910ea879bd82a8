"""Regret: what was learned against the optimum, exactly."""

import numpy as np
import pytest

import tuckerl
from tests.learners.worlds import corridor, random_mdp
from tests.reference.value_iteration import greedy_policy, model_of, optimal_values, policy_values
from tuckerl import QLearning, Regret, regret
from tuckerl.cli import main
from tuckerl.errors import NoTableError, ParameterTypeError, ProblemError


def test_regret_is_the_twins_over_the_first_states() -> None:
    mdp = random_mdp(3, 8, 3, n_outcomes=2, random_start=True)
    q = np.random.default_rng(0).normal(size=(8, 3))
    agent = QLearning(mdp, gamma=0.9, initial_q=q, seed=0)
    model = model_of(mdp)
    best = model.start @ optimal_values(model, 0.9)
    reached = model.start @ policy_values(model, greedy_policy(model, q), 0.9)
    found = regret(agent)
    assert isinstance(found, Regret)
    np.testing.assert_allclose(found, (best - reached, best, reached), atol=1e-7)
    assert found.regret > 0.1


def test_optimal_tables_have_none() -> None:
    mdp = random_mdp(4, 8, 3, n_outcomes=2, random_start=True)
    optimal = tuckerl.solve(mdp, 0.9)
    assert regret(QLearning(mdp, gamma=0.9, initial_q=optimal.q, seed=0)).regret == pytest.approx(0.0, abs=1e-7)
    assert regret(QLearning("FrozenLake-v1", gamma=0.99, seed=0)).best == pytest.approx(0.542, abs=1e-3)


def test_without_a_discount_a_policy_that_does_not_end_is_refused() -> None:
    agent = QLearning(corridor(), gamma=1.0, seed=0)
    with pytest.raises(ProblemError, match="with gamma=1 the policy must end with probability 1: in state 0"):
        regret(agent)
    assert regret(agent.learn(episodes=100)) == (0.0, -5.0, -5.0)


def test_it_needs_a_learner_that_knows_its_transitions() -> None:
    with pytest.raises(NoTableError, match=r"regret needs the transitions of .*evaluate\(\) judges by the returns"):
        regret(QLearning("FrozenLake-v1", compiled=False, seed=0))
    with pytest.raises(ParameterTypeError, match="learner must be one of tuckerl's learners; got 'agent'"):
        regret("agent")  # type: ignore[arg-type]  # that is what is tested


def test_the_command_line_says_it(tmp_path: object, capsys: pytest.CaptureFixture[str]) -> None:
    file = f"{tmp_path}/agent.tuckerl"
    for gamma, message in (
        (0.9, r"Regret of its greedy policy from the first states (gamma 0.9): "),
        (1.0, "Regret: "),
    ):
        QLearning(corridor(), gamma=gamma, seed=0).save(file)
        with pytest.raises(SystemExit) as end:
            main(["evaluate", file, "--episodes", "2"])
        assert end.value.code == 0
        assert message in capsys.readouterr().out
