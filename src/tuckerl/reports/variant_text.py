"""What a variant is and was given, in words, as all pages tell it."""

from tuckerl.reports.text import ranks_of, share_of
from tuckerl.studies.study import Variant


def described(variant: Variant) -> str:
    """Return what a variant is."""
    step = variant.tensor_step
    if step is None:
        return "without the tensor step"
    weights = {
        "paper": "tensor step as printed",
        "constant": "control: constant weights",
        "permuted": "control: permuted weights",
    }.get(str(step.weights), f"weights: {step.weights if isinstance(step.weights, str) else 'own function'}")
    share = step.share if isinstance(step.share, str) else "own function"
    if variant.n_agents == 1:
        return weights
    return f"{weights}; {'no sharing' if share == 'none' else f'share: {share}'}"


def settings(variant: Variant) -> str:
    """Return the parameters that a variant was given."""
    step = variant.tensor_step
    words = [f"{name} {value}" for name, value in variant.parameters.items()] or [
        "all parameters as they are by default"
    ]
    if step is not None:
        words.append(
            f"tensor step every {step.every} episodes with {ranks_of(step.ranks)}, weights {step.weights}, "
            f"{share_of(step)}, floor {step.floor:g}"
        )
    return "; ".join(words)
