"""The kernels are Python, too: without a compiler they learn the same."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.slow

CODE = """
import sys
import numpy as np
from tests.learners.stepped_worlds import TableEnv
from tests.learners.test_masks import masked_mdp
from tests.adapters.parallel_worlds import Masked
from tuckerl import DynaH, QLearning, SarsaLambda, TeamQ, TensorStep

step = TensorStep(every=3, ranks=(2, 2, 2, 1), floor=0.1)
mdp = masked_mdp(3, n_states=5, limit=10)
tables = {
    "extracted": SarsaLambda(mdp, seed=1, n_agents=2, tensor_step=step),
    "in Python": QLearning(TableEnv(mdp), seed=1, tensor_step=step),
    "team": TeamQ(TableEnv(mdp), seed=1),
    "dyna": DynaH(TableEnv(mdp), seed=1, heuristic=np.arange(5.0), planning_steps=2),
    "independent agents": QLearning(Masked(), seed=1, tensor_step=step),
}
np.savez(sys.argv[1], **{name: learner.learn(4).q for name, learner in tables.items()})
"""


@pytest.mark.compiled
def test_learners_work_without_a_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    for disabled in ("0", "1"):
        monkeypatch.setenv("NUMBA_DISABLE_JIT", disabled)
        path = tmp_path / f"{disabled}.npz"
        subprocess.run([sys.executable, "-c", CODE, str(path)], check=True, cwd=Path(__file__).parents[2])
        with np.load(path) as tables:
            found.append({name: tables[name] for name in tables.files})
    compiled, interpreted = found
    for name, table in compiled.items():
        np.testing.assert_allclose(interpreted[name], table, rtol=1e-12, atol=1e-12, err_msg=name)
        assert table.any()
