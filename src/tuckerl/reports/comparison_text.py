"""What came out of a comparison, in sentences."""

import math
from collections.abc import Sequence

from tuckerl.reports.text import all_pairs, amount, amount_interval, counted, joined, measured, measured_interval
from tuckerl.studies.comparison_result import Compared
from tuckerl.studies.estimates import Estimate


def outcome_of(compared: Compared) -> str:
    """Return the result in two or three sentences, one of them on the control."""
    if compared.difference.n_pairs == 0:
        return difference_of(compared)
    return f"{difference_of(compared)} {against_control(compared)}".rstrip()


def outcome_in_study(compared: Compared) -> str:
    """Return the result in a sentence or more: of two without a tensor step, nobody expects a control."""
    is_plain = compared.base.tensor_step is compared.candidate.tensor_step is None
    return difference_of(compared) if is_plain else outcome_of(compared)


def experience_of(compared: Compared, n_episodes: int) -> str:
    """Return who plays more episodes, or that nobody does though agents are more; "" of one agent against one."""
    base, candidate = compared.base, compared.candidate
    if base.n_agents == candidate.n_agents:
        return ""
    more, less = (candidate, base) if candidate.n_agents > base.n_agents else (base, candidate)
    if more.n_episodes is not None:
        return (
            f"Both play {counted(n_episodes, 'episode')} in all: {more.name} has {more.n_agents} agents, each of which "
            f"plays {more.n_episodes:,} of them."
        )
    times = f"{more.n_agents / less.n_agents:g}"
    return (
        f"{more.name} plays {_TIMES.get(times, f'{times} times')} the episodes of {less.name}: {more.n_agents} agents "
        f"with {n_episodes:,} each. --equal-experience holds the sum over agents equal."
    )


_TIMES = {"2": "twice", "3": "three times", "4": "four times", "5": "five times"}


def regrets_of(regrets: Sequence[Estimate]) -> str:
    """Return how far from the best policy the variants' learned ones are, in a sentence; "" where it is not known."""
    if not regrets:
        return ""
    each = joined(
        [f"{one.variant} {measured(one.mean)} {measured_interval(one.low, one.high)}".strip() for one in regrets]
    )
    return f"Regret of what was learned in the end, against the optimal values of the first states: {each}."


def difference_of(compared: Compared) -> str:
    """Return what the difference says in one sentence."""
    comparison, difference = compared.comparison, compared.difference
    base, candidate = comparison.base, comparison.candidate
    if difference.n_pairs == difference.n_diverged == 0:
        return f"There is no pair of {candidate} and {base} yet."
    if math.isnan(difference.mean):
        return f"Nothing is left to compare: in {all_pairs(difference.n_diverged)} a run diverged."
    pairs = counted(difference.n_pairs, "pair")
    reached = " against ".join(measured(one.mean) for one in reversed(compared.estimates[:2]))
    words = f"{compared.measure.text} {reached}"
    by = f"{amount(difference)} {amount_interval(difference)}".strip()
    if compared.verdict == "not decided":
        why = "one pair has no interval" if math.isnan(difference.low) else "the interval covers 0"
        return f"These runs do not decide between {candidate} and {base}: {words}, difference {by} over {pairs}; {why}."
    return f"{candidate} does {compared.verdict} than {base}: {words}, difference {by} over {pairs}."


def against_control(compared: Compared) -> str:
    """Return what the control says of the difference, or why there is none."""
    comparison, control = compared.comparison, compared.control
    if not comparison.control:
        return f"No control was played: {compared.no_control}."
    if math.isnan(control.low):
        return f"There are too few pairs to compare it with the control, {comparison.control}."
    by = f"{amount(control)} {amount_interval(control)}"
    how = "better" if control.low > 0 else "worse" if control.high < 0 else "neither better nor worse"
    return f"{comparison.candidate} does {how} than the control, {comparison.control}: {by}. {_meaning(compared)}"


def _meaning(compared: Compared) -> str:
    """Say what may be concluded of a gain from the comparison with the control."""
    if compared.candidate.tensor_step is None:
        return "That control is the base's own: it shows how far the base's weights matter."
    if compared.verdict != "better":
        return ""
    shared = _shared(compared)
    if compared.control.low > 0:
        return f"So what the control has too, {shared}, does not explain all of the gain over the base."
    if compared.control.high < 0:
        return "So the gain over the base is not the tensor's: with equal weights for all actions it is larger."
    return f"So what the control has too, {shared}, explains the gain over the base, as far as these runs can tell."


def _shared(compared: Compared) -> str:
    """Return what the control shares with the candidate and not with the base."""
    base, candidate = compared.base, compared.candidate
    parts = []
    if (base.learner, base.parameters) != (candidate.learner, candidate.parameters):
        parts.append("the algorithm and its parameters")
    if base.tensor_step is None:
        parts.append("the smaller learning rate")
    if candidate.n_agents != base.n_agents:
        parts.append("the sharing among its agents")
    return joined(parts) or "the tensor step with constant weights"
