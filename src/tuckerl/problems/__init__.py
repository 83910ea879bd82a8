"""The kinds of problem: transition tables, simulators, mazes."""
