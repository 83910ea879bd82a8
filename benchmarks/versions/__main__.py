"""The command line of the package; its documentation says what the commands do."""

import argparse
import sys

from benchmarks.versions import bits, first_use, load, speed


def main() -> int:
    """Run one command and return its exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.versions")
    commands = parser.add_subparsers(dest="command", required=True)
    same = commands.add_parser("bits", help="compare what both versions compute, bit by bit")
    same.add_argument("--studies", action="store_true", help="compare small studies as well")
    fast = commands.add_parser("speed", help="time kernels of both versions in turn")
    fast.add_argument("--rounds", type=int, default=15)
    first = commands.add_parser("compile", help="time the first use of learners")
    first.add_argument("--rounds", type=int, default=3)
    cost = commands.add_parser("load", help="time the T-versions over both versions' bases, for claim C8")
    cost.add_argument("--rounds", type=int, default=9)
    for command in (same, fast, first, cost):
        command.add_argument("old", metavar="OLD", help="a commit")
        command.add_argument("--only", metavar="WORDS", default="", help="leave out all whose names lack them")
    chosen = parser.parse_args()
    if chosen.command == "bits":
        return 0 if bits.compare(chosen.old, chosen.only, studies=chosen.studies) else 1
    timed = {"speed": speed, "compile": first_use, "load": load}[chosen.command]
    timed.compare(chosen.old, chosen.rounds, chosen.only)
    return 0


if __name__ == "__main__":
    sys.exit(main())
