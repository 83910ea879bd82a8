"""Known models solved: optimal values and those of a policy, from a table of transitions. No learner is in here."""
