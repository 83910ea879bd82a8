"""Write the figures of README and the pages from what was measured, so that they are the same everywhere.

``python -m docs.pictures.numbers`` writes the parts from ``claims.json`` and ``bench.json`` beside this file. With
a folder of results, ``python -m docs.pictures.numbers results/paper``, it first takes over what ``make reproduce``
wrote there: ``claims.json`` and the picture of Figure 11. ``python -m benchmarks --out docs/pictures/bench.json``
measures the speeds. `tests/docs/test_numbers.py` fails when a page has other figures.
"""

import json
import math
import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.timing import duration

from tuckerl.files import write_whole
from tuckerl.reports.text import NOTHING, amount, amount_interval, joined
from tuckerl.studies.claims import IS_BETTER_THAN_CONSTANT, MOST_TIME
from tuckerl.studies.scenarios import SCENARIOS
from tuckerl.studies.statistics import Difference

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
CLAIMS, BENCH, FIGURE = HERE / "claims.json", HERE / "bench.json", HERE / "fig11.png"

Entry = dict[str, Any]
Measured = dict[str, list[Entry]]

IN_THE_IDEA = ("C1", "C3", "C5", "C6", "C7")

TITLES = {
    "steps": "A step of one-step learners, beside C++",
    "kernels": "Updates in a maze, beside C and pure Python",
    "planning": "Learners that plan",
    "traces": "Eligibility traces",
    "n_step": "Expected SARSA, Double Q and several steps",
    "toy_text": "Gymnasium's environments from their tables",
    "stepping": "Environments that are stepped in Python",
    "solving": "Known models solved",
    "decomposition": "Tucker decompositions",
    "windows": "A window of the paper's step",
    "sharing": "Sharing, by the rows that changed",
    "studies": "Runs of a study",
    "large_study": "A study of 100,000 runs",
    "experiment": "All three experiments, with everything taken apart",
}
"""The benchmarks that the page about speed shows, each with the title of its table."""

ALONE = ("solving", "large_study", "experiment")  # rows of these are shown without a peer, too


class Pick(NamedTuple):
    """A row of a benchmark that README shows."""

    text: str  # what it is
    benchmark: str
    what: str
    peers: tuple[tuple[str, str], ...]  # the beginning of a peer's name, and what it is called


PICKS = (
    Pick("an update of Q-learning in a maze", "kernels", "Q-learning", (("the same loop in C", "the same loop in C"),)),
    Pick(
        "a step of Q-learning on Taxi-v4",
        "toy_text",
        "Q-learning, Taxi-v4",
        (("NumPy and Gymnasium", "the loop in NumPy and Gymnasium"), ("table-rl", "table-rl")),
    ),
    Pick(
        "a step of SARSA(λ), 1404 x 4",
        "traces",
        "SARSA(lambda), 1404 x 4",
        (("the same in C", "the same in C"), ("C, active list", "a list of active traces in C")),
    ),
    Pick(
        "the best policy of a maze of 39 x 36",
        "solving",
        "maze 39 x 36, value-iteration",
        (("QuantEcon", "QuantEcon"),),
    ),
    Pick(
        "a Tucker decomposition of a maze's tables",
        "decomposition",
        "maze tables (1404, 4, 10, 3)",
        (("TensorLy", "TensorLy, at the same fit"),),
    ),
)


def difference_of(claim: Entry, *names: str) -> Difference:
    """Return a difference and its interval by their names in ``claims.json``."""
    mean, low, high = (math.nan if claim[name] is None else float(claim[name]) for name in names)
    return Difference(mean, low, high, claim["runs"], 0, claim.get("relative", True))


def with_interval(difference: Difference) -> str:
    """Return a difference with its interval, "" where there is none."""
    text = amount(difference)
    return "" if text == NOTHING else f"{text} {amount_interval(difference)}"


def own(claim: Entry) -> Difference:
    """Return a claim's difference."""
    return difference_of(claim, "difference", "low", "high")


def control(claim: Entry) -> Difference:
    """Return its difference against the control."""
    return difference_of(claim, "control_difference", "control_low", "control_high")


def constant(claim: Entry) -> Difference:
    """Return the difference of the same comparison with constant weights."""
    return difference_of(claim, "constant_difference", "constant_low", "constant_high")


def _tensor(claim: Entry) -> str:
    mark = " \\*" if claim["tensor_question"] == IS_BETTER_THAN_CONSTANT else ""
    return f"{claim['tensor']}{mark}" if claim["tensor"] else NOTHING


def _table(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    head = list(heads)
    return "\n".join("| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *rows))


def claims_table(claims: list[Entry]) -> str:
    """Return all claims with both verdicts."""
    heads = (
        *("claim", "does it hold?", "is it the tensor?"),
        *("difference", "against the control", "with constant weights"),
    )
    return _table(
        heads,
        (
            (
                f"{claim['id']} {claim['claim']}",
                claim["verdict"],
                _tensor(claim),
                with_interval(own(claim)) or claim["detail"],
                with_interval(control(claim)),
                with_interval(constant(claim)),
            )
            for claim in claims
        ),
    )


def idea_table(claims: list[Entry]) -> str:
    """Return the claims that the page about the idea speaks of."""
    rows = [
        (claim["claim"], claim["verdict"], _tensor(claim), amount(own(claim)), amount(control(claim)))
        for claim in claims
        if claim["id"] in IN_THE_IDEA
    ]
    return _table(("claim", "does it hold?", "is it the tensor?", "difference", "against the constant control"), rows)


def _grouped(claims: list[Entry], answer: Callable[[Entry], str]) -> str:
    """Return, of each answer, the claims that have it."""
    named = {one: [claim["id"] for claim in claims if answer(claim) == one] for one in map(answer, claims)}
    return "; ".join(f"{joined(names)} {_of_many(one) if len(names) > 1 else one}" for one, names in named.items())


def _of_many(answer: str) -> str:
    return {"holds": "hold", "does not hold": "do not hold"}.get(answer, answer)


def verdict_lines(claims: list[Entry]) -> str:
    """Return the verdicts, a row for each of the paper's scenarios, and in a line those on all of them."""
    rows = []
    for name, scenario in SCENARIOS.items():
        ours = [claim for claim in claims if claim["scenario"] == name]
        if scenario.is_of_paper:
            holds, tensor = _grouped(ours, lambda claim: claim["verdict"]), _grouped(ours, _tensor)
            first, ours_own, against = ours[0]["id"], with_interval(own(ours[0])), with_interval(control(ours[0]))
            rows.append((scenario.title, f"{holds}; {first}: {ours_own}", f"{tensor}; {first}: {against}"))
    heads = ("", "does the claim hold?", "is it the tensor? (against a constant smaller rate)")
    load, weights = (next(claim for claim in claims if claim["id"] == name) for name in ("C8", "C9"))
    return (
        f"{_table(heads, rows)}\n\n"
        "\\* C2, C4, C6 and C10 are about copying among agents; of them it is asked whether the weights beat "
        f"a constant rate. C8, no big computational load: {load['verdict']}; a step takes up to {load['ratio']:.1f} "
        f"times the base's processor time, allowed {MOST_TIME:g}. C9, every ω is in (0, 1]: {weights['verdict']}."
    )


def _times(ratio: float) -> str:
    return f"{ratio:.2f}" if ratio < 0.995 else f"{ratio:.1f}" if ratio < 9.95 else f"{ratio:,.0f}"


def speed_lines(measured: Measured) -> str:
    """Return five lines about speed for README."""
    rows = []
    for pick in PICKS:
        found = [row for row in measured[pick.benchmark] if row["what"] == pick.what]
        beside = [(name, row) for begin, name in pick.peers for row in found if row["peer_name"].startswith(begin)]
        peers = [f"{_times(row['ratio'])} times as fast as {name}" for name, row in beside if row["ratio"]]
        rows.append((pick.text, duration(found[0]["ours"]), "; ".join(peers) or NOTHING))
    return _table(("", "takes", "which is"), rows)


def bench_tables(measured: Measured) -> str:
    """Return all rows that have a peer, and those of whole experiments, a table for each benchmark."""
    parts = []
    for name, title in TITLES.items():
        rows = [row for row in measured.get(name, []) if row["peer"] or (row["peer_name"] == "-" and name in ALONE)]
        if rows:
            heads = ("what", "unit", "tuckerl", "peer", "its time", "times faster")
            parts.append(f"**{title}**\n\n{_table(heads, map(_bench_row, rows))}")
    return "\n\n".join(parts)


def _bench_row(row: Entry) -> tuple[str, ...]:
    peer = (row["peer_name"], duration(row["peer"]), _times(row["ratio"])) if row["peer"] else ("", "", "")
    return (row["what"], row["unit"], duration(row["ours"]), *peer)


PARTS: dict[tuple[str, str], tuple[Path, Callable[[Any], str]]] = {
    ("README.md", "verdicts"): (CLAIMS, verdict_lines),
    ("README.md", "speed"): (BENCH, speed_lines),
    ("docs/results.md", "claims"): (CLAIMS, claims_table),
    ("docs/idea.md", "claims"): (CLAIMS, idea_table),
    ("docs/how-fast.md", "bench"): (BENCH, bench_tables),
}
"""What is written where: a page and the name of a part of it, the file of its figures, and what makes the text."""


def part_pattern(name: str) -> re.Pattern[str]:
    """Return what finds a part of a page, between comments that no reader sees."""
    return re.compile(rf"(?<=<!-- begin {name} -->\n)(.*?)(?=<!-- end {name} -->\n)", re.DOTALL)


def text_of(page: str, name: str) -> str:
    """Return the text of a part, from the figures beside this file."""
    source, make = PARTS[page, name]
    return make(json.loads(source.read_text("utf-8")))


def take_over(results: Path) -> None:
    """Copy what ``make reproduce`` wrote, if it is of all the paper's claims."""
    claims = json.loads((results / "claims.json").read_text("utf-8"))
    if len(claims) < 10:
        sys.exit(f"{results} has {len(claims)} claims, and the pages need all 10: run make reproduce")
    write_whole(CLAIMS, json.dumps(claims, indent=1, ensure_ascii=False).encode() + b"\n")
    write_whole(FIGURE, (results / "figures" / "fig11.png").read_bytes())


def main() -> None:
    """Write all parts into their pages."""
    if sys.argv[1:]:
        take_over(Path(sys.argv[1]))
    for page, name in PARTS:
        path = ROOT / page
        path.write_text(filled(path.read_text("utf-8"), name, text_of(page, name)), "utf-8")


def filled(page: str, name: str, text: str) -> str:
    """Return a page with this text in one of its parts."""
    return part_pattern(name).sub(lambda _: f"{text}\n", page)


if __name__ == "__main__":
    main()
