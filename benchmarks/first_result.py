"""What a user waits for before the first result: processor time of a process that has no kernels compiled yet."""

import json
import os
import subprocess
import sys
import tempfile

from benchmarks.timing import Row

REPEATS = 3

_PROGRAM = """
import json
import time
from numba.core.event import Listener, install_listener

class Spent(Listener):
    def __init__(self):
        self.seconds, self.depth = 0.0, 0
    def on_start(self, event):
        self.depth += 1
        if self.depth == 1:
            self.begun = time.thread_time()
    def on_end(self, event):
        self.depth -= 1
        if self.depth == 0:
            self.seconds += time.thread_time() - self.begun

llvm = Spent()
begun = time.process_time()
import tuckerl
agent = tuckerl.QLearning("Taxi-v4", seed=0)
found = {"imports": time.process_time() - begun}
with install_listener("numba:llvm_lock", llvm):
    for name in ("learn", "evaluate"):
        begun, before = time.process_time(), llvm.seconds
        getattr(agent, name)(1)
        spent = time.process_time() - begun
        found[f"{name}, LLVM"] = llvm.seconds - before
        found[f"{name}, Numba and the rest"] = spent - (llvm.seconds - before)
        begun = time.process_time()
        getattr(agent, name)(1)
        found[f"{name}, compiled"] = time.process_time() - begun
print(json.dumps(found))
"""


def rows() -> list[Row]:
    """Time Q-learning's first `learn` and first `evaluate` on Taxi-v4, the least of some processes in all."""
    found: list[dict[str, float]] = []
    for _ in range(REPEATS):
        with tempfile.TemporaryDirectory() as cache:
            environment = os.environ | {"NUMBA_CACHE_DIR": cache}
            command = [sys.executable, "-c", _PROGRAM]
            done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        found.append(json.loads(done.stdout))
    least = min(found, key=lambda times: sum(times.values()))
    return [Row(what, "process", spent, "-", None, None) for what, spent in least.items()]
