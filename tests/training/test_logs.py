"""Logs by numbers worked out by hand, and where a run goes on from a checkpoint."""

import json
import struct
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from tensorboardX.event_file_writer import EventsWriter

from tests.learners.worlds import random_mdp
from tests.training.counting import countings
from tuckerl import Callback, Checkpoint, CsvLog, Harmonic, JsonLinesLog, Linear, QLearning, TensorBoard, TensorStep
from tuckerl.errors import MissingExtraError, OutputError, ParameterError
from tuckerl.training.learner import Learner

PROBLEM = random_mdp(71, n_outcomes=2)
STEP = TensorStep(every=5, ranks=(2, 2, 2, 1), floor=0.1)

# Two agents, returns e and e + 10, steps 1, 2, 3, 1, 2, 3, ...; alpha = 1 / (1 + e), epsilon = 1 - e / 8 in episode e.
HEAD = "episode,steps,mean_return,mean_steps,alpha,epsilon\n"
FOUR = "4,7,6.5,1.75,0.25,0.625\n"  # 1 + 2 + 3 + 1 steps; (0 + 1 + 2 + 3) / 4 + 5; the fourth episode has e = 3
EIGHT = "8,15,10.5,2.0,0.125,0.125\n"  # 2 + 3 + 1 + 2 more; (4 + 5 + 6 + 7) / 4 + 5


def counting_learner() -> QLearning:
    schedules: Any = {"alpha": Harmonic(1.0, half_after=1), "epsilon": Linear(1.0, 0.0, episodes=8)}
    return QLearning(countings(), n_agents=2, seed=1, **schedules)


def test_rows_of_values_by_hand(tmp_path: Path) -> None:
    path, seen = tmp_path / "log.csv", []
    log = CsvLog(path, every=4)
    learner = counting_learner()
    learner.learn(3, callbacks=[log])
    assert path.read_text() == HEAD
    learner.learn(6, callbacks=[log, lambda learner: seen.append(path.read_text())])
    assert path.read_text() == HEAD + FOUR + EIGHT
    other = CsvLog(tmp_path / "late.csv", every=4)
    learner.learn(1, callbacks=[other])
    assert other.path.read_text() == HEAD + FOUR + EIGHT  # what came before the log is told, too


def test_lines_of_json_by_hand(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    counting_learner().learn(9, callbacks=[JsonLinesLog(path, every=4)])
    first, second = (json.loads(line) for line in path.read_text().splitlines())
    rows = [dict(zip(HEAD.strip().split(","), json.loads(f"[{row}]"), strict=True)) for row in (FOUR, EIGHT)]
    assert first == rows[0] | {"weights": [1.0, 1.0]}
    assert second == rows[1] | {"weights": [1.0, 1.0]}


@pytest.mark.parametrize("every", [3, 5, 10])
def test_weights_are_those_after_the_window(every: int, tmp_path: Path) -> None:
    log, late = JsonLinesLog(tmp_path / "log", every=every), JsonLinesLog(tmp_path / "late", every=every)
    learner = QLearning(PROBLEM, n_agents=2, seed=1, tensor_step=STEP)
    expected = {}
    learner.learn(23, callbacks=[lambda learner: expected.update({learner.episodes: learner.action_weights}), log])
    learner.learn(1, callbacks=[late])
    rows = [json.loads(line) for line in log.path.read_text().splitlines()]
    assert [row["episode"] for row in rows] == list(range(every, 24, every))
    for row in rows:
        window = row["episode"] // 5 * 5
        assert row["weights"] == (expected[window].tolist() if window else [1.0, 1.0, 1.0])
    assert len({tuple(weights) for weights in expected.values()}) == 4
    told = late.path.read_text().splitlines()
    assert told[: len(rows)] == log.path.read_text().splitlines()


def test_the_default_windows_are_the_learners(tmp_path: Path) -> None:
    QLearning(PROBLEM, seed=1, tensor_step=STEP).learn(12, callbacks=[CsvLog(tmp_path / "log")])
    assert pl.read_csv(tmp_path / "log")["episode"].to_list() == [5, 10]
    QLearning(PROBLEM, seed=1).learn(250, callbacks=[CsvLog(tmp_path / "log")])
    assert pl.read_csv(tmp_path / "log")["episode"].to_list() == [100, 200]


class Reading(Callback):
    """Keeps what is in a file before the log writes into it."""

    def __init__(self, path: Path, seen: list[str]) -> None:
        super().__init__(9)
        self.path, self.seen = path, seen

    def on_window(self, learner: Learner) -> None:
        self.seen.append(self.path.read_text())


@pytest.mark.parametrize("kind", [CsvLog, JsonLinesLog])
def test_a_run_that_goes_on_has_every_row_once(kind: Any, tmp_path: Path) -> None:
    def fresh() -> QLearning:
        return QLearning(PROBLEM, n_agents=2, alpha=0.3, epsilon_decay=0.9, seed=1, tensor_step=STEP)

    log, whole = tmp_path / "log", tmp_path / "whole"
    fresh().learn(31, callbacks=[kind(whole, every=3)])
    # The log of a program that was stopped is further than its checkpoint, or has lost a row.
    fresh().learn(16, callbacks=[kind(log, every=3), Checkpoint(tmp_path / "agent{episode}", every=7)])
    further = log.read_text()
    for found in (further, further[:-30], ""):
        log.write_text(found)
        seen: list[str] = []
        again = QLearning.load(tmp_path / "agent7")
        again.learn(3, callbacks=[Reading(log, seen), kind(log, every=3)])
        again.learn(21, callbacks=[kind(log, every=3)])
        assert log.read_text() == whole.read_text()
        rows = 2 + (kind is CsvLog)  # of 3 and 6, and the head
        assert seen == ["".join(whole.read_text().splitlines(keepends=True)[:rows])]


def test_a_log_may_follow_one_learner_after_another(tmp_path: Path) -> None:
    log = CsvLog(tmp_path / "log", every=4)
    QLearning(PROBLEM, seed=1).learn(30, callbacks=[log])
    counting_learner().learn(9, callbacks=[log])
    assert log.path.read_text() == HEAD + FOUR + EIGHT


def test_numbers_are_read_back_to_the_last_bit(tmp_path: Path) -> None:
    learner = QLearning(PROBLEM, n_agents=3, alpha=1 / 3, epsilon_decay=0.9, seed=1)
    learner.learn(12, callbacks=[CsvLog(tmp_path / "log", every=4)])
    frame = pl.read_csv(tmp_path / "log")
    assert frame["mean_return"].to_list() == [learner.returns[i : i + 4].T.mean() for i in (0, 4, 8)]
    assert frame["alpha"].to_list() == [1 / 3] * 3
    assert frame["steps"].to_list() == [int(learner.steps[:n, 0].sum()) for n in (4, 8, 12)]


def test_readers_never_see_half_a_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, seen = tmp_path / "log", []
    replace = Path.replace

    def watched(self: Path, target: Any) -> Any:
        seen.append(path.read_text() if path.exists() else HEAD)
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", watched)
    counting_learner().learn(9, callbacks=[CsvLog(path, every=4)])
    assert seen == [HEAD, HEAD, HEAD + FOUR]


@pytest.mark.parametrize("kind", [CsvLog, JsonLinesLog, TensorBoard])
def test_what_cannot_be_written_is_found_before_anything_is_learned(kind: Any, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    learner = QLearning(PROBLEM, seed=1)
    with pytest.raises(OutputError, match=r"cannot write .*file"):
        learner.learn(3, callbacks=[kind(tmp_path / "file" / "log")])
    assert learner.episodes == 0
    with pytest.raises(ParameterError, match="every must be a whole number of at least 1; got 0"):
        kind(tmp_path / "log", every=0)


# What TensorBoard reads, by the formats' own descriptions: records of (length, checksum, bytes, checksum), and in each
# an Event of the protocol buffers' wire format.


def records(content: bytes) -> Iterator[bytes]:
    at = 0
    while at < len(content):
        (length,) = struct.unpack_from("<Q", content, at)
        yield content[at + 12 : at + 12 + length]
        at += 12 + length + 4


def varint(content: bytes, at: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        value |= (content[at] & 127) << shift
        at, shift = at + 1, shift + 7
        if content[at - 1] < 128:
            return value, at


def fields(content: bytes) -> Iterator[tuple[int, Any]]:
    at = 0
    while at < len(content):
        key, at = varint(content, at)
        number, kind = key >> 3, key & 7
        if kind == 0:
            value: Any
            value, at = varint(content, at)
        else:
            size, at = varint(content, at) if kind == 2 else ({1: 8, 5: 4}[kind], at)
            value, at = content[at : at + size], at + size
        yield number, value


def points_of(folder: Path) -> dict[tuple[str, int], float]:
    """Read the points that TensorBoard shows: a session that starts at a step hides those from there on."""
    points: dict[tuple[str, int], float] = {}
    for path in sorted(folder.iterdir()):
        for record in records(path.read_bytes()):
            event = dict(fields(record))
            step = event.get(2, 0)
            if 7 in event:
                points = {key: value for key, value in points.items() if key[1] < step}
            for _, summary in (field for field in fields(event.get(5, b""))):
                value = dict(fields(summary))
                points[value[1].decode(), step] = struct.unpack("<f", value[2])[0]
    return points


def test_points_of_tensorboard_by_hand(tmp_path: Path) -> None:
    counting_learner().learn(9, callbacks=[TensorBoard(tmp_path / "new" / "board", every=4)])
    four = {"return": 6.5, "steps": 1.75, "alpha": 0.25, "epsilon": 0.625}
    eight = {"return": 10.5, "steps": 2.0, "alpha": 0.125, "epsilon": 0.125}
    expected = {(tag, step): value for step, row in ((4, four), (8, eight)) for tag, value in row.items()}
    assert points_of(tmp_path / "new" / "board") == expected


def test_tensorboard_shows_the_weights(tmp_path: Path) -> None:
    learner = QLearning(PROBLEM, n_agents=2, seed=1, tensor_step=STEP).learn(12, callbacks=[TensorBoard(tmp_path)])
    points = points_of(tmp_path)
    assert sorted({tag for tag, _ in points}) == sorted(
        ["return", "steps", "alpha", "epsilon", "weights/0", "weights/1", "weights/2"]
    )
    for window, episode in enumerate((5, 10)):
        for action, weight in enumerate(learner.tensor_step_history.weights[window]):
            assert points[f"weights/{action}", episode] == pytest.approx(weight, rel=1e-6)


def test_calls_within_one_second_have_files_of_their_own(tmp_path: Path) -> None:
    board, learner = TensorBoard(tmp_path, every=2), QLearning(PROBLEM, seed=1)
    learner.learn(5, callbacks=[board]).learn(5, callbacks=[board])
    assert {step for _, step in points_of(tmp_path)} == {2, 4, 6, 8, 10}


def written(folder: Path) -> list[tuple[str, int]]:
    """Read which points the files hold, also those that TensorBoard hides."""
    found = []
    for path in sorted(folder.iterdir()):
        for record in records(path.read_bytes()):
            event = dict(fields(record))
            summaries = (dict(fields(summary)) for _, summary in fields(event.get(5, b"")))
            found += [(summary[1].decode(), event[2]) for summary in summaries]
    return found


def fresh_learner() -> QLearning:
    return QLearning(PROBLEM, n_agents=2, alpha=0.3, epsilon_decay=0.9, seed=1, tensor_step=STEP)


@pytest.mark.parametrize("every", [2, 5])
@pytest.mark.parametrize("saved_at", [4, 5, 10, 14])
def test_a_board_that_goes_on_has_every_window_once(every: int, saved_at: int, tmp_path: Path) -> None:
    # An earlier program's board is further than its checkpoint, or (which was there first) not as far, or lost.
    fresh_learner().learn(23, callbacks=[TensorBoard(tmp_path / "whole", every=every)])
    whole = points_of(tmp_path / "whole")
    agent = fresh_learner().learn(saved_at)
    agent.save(tmp_path / "agent")
    for played in (saved_at + 3, saved_at - 3, 0):
        board = TensorBoard(tmp_path / f"board{played}", every=every)
        if played:
            fresh_learner().learn(played, callbacks=[board])
        again = QLearning.load(tmp_path / "agent")
        again.learn(3, callbacks=[board])
        again.learn(23 - saved_at - 3, callbacks=[TensorBoard(board.folder, every=every)])
        assert points_of(board.folder) == whole
        assert sorted(written(board.folder)) == sorted(whole), "no point twice"


def test_a_board_shows_every_window_once_where_the_earlier_file_could_not_be_deleted(tmp_path: Path) -> None:
    board = TensorBoard(tmp_path / "board", every=2)
    fresh_learner().learn(9, callbacks=[board])
    (earlier,) = board.folder.iterdir()
    content = earlier.read_bytes()
    fresh_learner().learn(7, callbacks=[board])
    earlier.write_bytes(content)  # as after a kill at that moment
    assert {step for _, step in points_of(board.folder)} == {2, 4, 6}


def test_a_board_leaves_files_of_others_alone(tmp_path: Path) -> None:
    (tmp_path / "events.out.tfevents.1.host").write_bytes(b"")
    for _ in range(2):
        fresh_learner().learn(9, callbacks=[TensorBoard(tmp_path)])
    assert len(list(tmp_path.iterdir())) == 2
    assert (tmp_path / "events.out.tfevents.1.host").exists()


def test_a_full_disk_is_said_by_a_board(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    flush: Any = EventsWriter.flush
    calls: list[int] = []

    def full_at_the_second(writer: Any) -> Any:
        calls.append(1)
        if len(calls) == 2:
            raise OSError(28, "No space left on device")
        return flush(writer)

    monkeypatch.setattr(EventsWriter, "flush", full_at_the_second)
    with pytest.raises(OutputError, match=r"cannot write into .*: No space left on device; make room there"):
        fresh_learner().learn(9, callbacks=[TensorBoard(tmp_path)])


@pytest.mark.parametrize("kind", [CsvLog, JsonLinesLog, TensorBoard])
def test_a_window_whose_tensor_step_is_still_to_come_is_not_told(kind: Any, tmp_path: Path) -> None:
    broken = [True]

    def weights(decomposition: Any) -> Any:
        if broken[0]:
            raise ConnectionError("lost")
        return [0.5, 0.25, 0.125]

    def learner() -> QLearning:
        step = TensorStep(every=5, ranks=(2, 2, 2, 1), weights=weights)
        return QLearning(PROBLEM, n_agents=2, seed=1, tensor_step=step)

    again = learner()
    with pytest.raises(ConnectionError):
        again.learn(10, callbacks=[kind(tmp_path / "log")])
    assert again.episodes == 5
    broken[0] = False
    again.learn(5, callbacks=[kind(tmp_path / "log")])
    learner().learn(10, callbacks=[kind(tmp_path / "whole")])
    if kind is TensorBoard:
        assert points_of(tmp_path / "log") == points_of(tmp_path / "whole")
        assert sorted(written(tmp_path / "log")) == sorted(written(tmp_path / "whole"))
    else:
        assert (tmp_path / "log").read_text() == (tmp_path / "whole").read_text()


def test_points_can_be_seen_while_it_learns(tmp_path: Path) -> None:
    seen: list[set[int]] = []
    QLearning(PROBLEM, seed=1).learn(
        200, callbacks=[TensorBoard(tmp_path), lambda learner: seen.append({step for _, step in points_of(tmp_path)})]
    )
    assert seen == [{100}, {100, 200}]


def test_the_extra_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "tensorboardX", None)
    with pytest.raises(MissingExtraError, match=r'not installed: pip install "tuckerl\[tensorboard\]"'):
        TensorBoard(tmp_path)
    with pytest.raises(ImportError):
        TensorBoard(tmp_path)
