"""The likeliest mistakes on the command line, answered with the line to type."""

import re
import shlex
from collections.abc import Sequence
from typing import Any

from typer.exceptions import TyperException

from tuckerl.checks import did_you_mean, shown

_COMMANDS = {
    "learn": "train",
    "fit": "train",
    "eval": "evaluate",
    "test": "evaluate",
    "play": "evaluate",
    "plot": "show",
    "inspect": "show",
    "view": "show",
    "ls": "list",
    "algorithms": "list algorithms",
    "environments": "list environments",
    "envs": "list environments",
    "version": "--version",
    "help": "--help",
}
"""What is called otherwise elsewhere, and the command here."""

_OPTIONS = {
    "--timesteps": "--steps",
    "--total-timesteps": "--steps",
    "--n-episodes": "--episodes",
    "--num-episodes": "--episodes",
    "--n-runs": "--runs",
    "--seeds": "--runs",
    "--n-agents": "--agents",
    "--jobs": "--workers",
    "--n-jobs": "--workers",
    "--output": "--out",
    "--force": "--overwrite",
    "--environment": "--env",
}
_POSITIONAL = ("--env", "--environment", "--algorithm", "--algo", "--file", "--dir")
_PARAMETERS = {"lambda": "lambda_", "learning_rate": "alpha", "lr": "alpha", "discount": "gamma", "eps": "epsilon"}
_SETTERS = ("--set", "--env-set")


def answer(error: TyperException, arguments: Sequence[str]) -> str:
    """Return what is said of a line that cannot be parsed: what is wrong, and where it can be told, the line to type.

    Parameters
    ----------
    error : TyperException
    arguments : sequence of str
        The line without the command's own name.
    """
    words, known = list(arguments), _options_of(error)
    option = getattr(error, "option_name", "")
    if type(error).__name__ == "NoSuchOption" and option:
        return _unknown_option(str(option), words, known) or error.format_message()
    if type(error).__name__ == "BadParameter":
        return _bad_number(error, words) or error.format_message()
    if type(error).__name__ == "MissingParameter":
        return _missing(error, words, known)
    message = error.format_message()
    if message.startswith("No such command"):
        return _unknown_command(words) or message
    if "requires an argument" in message and option in _SETTERS:
        return f"{option} needs NAME=VALUE after it, such as {option} {_example(str(option))}"
    if "unexpected extra argument" in message:
        return _extra(words, known) or f"{message}: `tuckerl {words[0]} --help` shows what it takes"
    return message


def _options_of(error: TyperException) -> list[str]:
    """Return the options of the command that an error is about."""
    command = getattr(error, "cmd", None) or getattr(getattr(error, "ctx", None), "command", None)
    return [name for parameter in getattr(command, "params", ()) for name in parameter.opts if name.startswith("--")]


def line(words: Sequence[str]) -> str:
    """Return a line as it is typed, between backticks."""
    return f"`{shlex.join(['tuckerl', *words])}`"


def _example(setter: str) -> str:
    return "alpha=0.3" if setter == "--set" else "is_slippery=false"


def _unknown_option(option: str, words: list[str], known: list[str]) -> str:
    """Return the answer to an option that a command does not have; "" where it is not found in the line."""
    place = next((at for at, word in enumerate(words) if word.partition("=")[0] == option), None)
    if place is None:
        return ""
    _, equals, value = words[place].partition("=")
    rest = words[place + 1 :]
    if not equals and rest and not rest[0].startswith("--"):
        value, rest = rest[0], rest[1:]
    before, given = words[:place], [value] if value else []
    parameter = _parameter(option) if "--set" in known and value else ""
    if parameter:
        setter = "--search" if ":" in value and "--search" in known else "--set"
        corrected = [*before, setter, f"{parameter}={value}", *rest]
        return f"there is no option {option}, but a parameter {parameter}: {line(corrected)}"
    meant = _OPTIONS.get(option, "")
    if meant in known:
        return f"there is no option {option}, but {meant}: {line([*before, meant, *given, *rest])}"
    if option in _POSITIONAL and value and before:
        corrected = [word for word in [*before, value, *rest] if word not in _POSITIONAL]
        return f"there is no option {option}, its value stands alone: {line(corrected)}"
    setters = [f"{one} NAME=VALUE sets {what}" for one, what in _WHAT.items() if one in known]
    help_line = line([*before[:1], "--help"])
    return (
        f"there is no option {option}: {did_you_mean(option, known) or f'{help_line} shows those that there are'}"
        + (f"; {' and '.join(setters)}" if setters else "")
    )


_WHAT = {"--set": "a parameter", "--env-set": "a keyword of the environment"}


def _parameter(option: str) -> str:
    """Return the parameter of an algorithm that an option is called like; "" where there is none."""
    from tuckerl.studies.algorithms import ALGORITHMS, parameters_of

    name = option.removeprefix("--").replace("-", "_")
    name = _PARAMETERS.get(name, name)
    side, _, own = name.rpartition(".")
    return (
        name if side in ("", "base", "candidate") and any(own in parameters_of(a) for a in ALGORITHMS.values()) else ""
    )


def _extra(words: list[str], known: list[str]) -> str:
    """Return the answer to words too many: those of NAME=VALUE with blanks, or without --set; "" for others."""
    corrected = _joined(words)
    if corrected == words and "--set" in known:
        corrected = _with_set(words)
    if corrected != words:
        return f"NAME=VALUE is one word, after --set or --env-set: {line(corrected)}"
    return ""


def _joined(words: list[str]) -> list[str]:
    """Return a line with ``--set alpha 0.3`` and ``--set alpha = 0.3`` as ``--set alpha=0.3``."""
    text = list(words)
    at = 0
    while at < len(text):
        option, equals, name = text[at].partition("=")
        if option in _SETTERS:
            start = at if equals else at + 1
            name = name if equals else "".join(text[start : start + 1])
            end = start + 1
            while end < len(text) and end < start + 3 and not text[end].startswith("--") and not _is_setting(name):
                name += text[end] if "=" in name or text[end].startswith("=") else f"={text[end]}"
                end += 1
            text[at:end] = [option, name]
            at += 1
        at += 1
    return text


def _is_setting(text: str) -> bool:
    return re.fullmatch(r"[^=]+=.+", text) is not None


def _with_set(words: list[str]) -> list[str]:
    """Return a line with ``--set`` before each ``name=value`` that stands alone."""
    corrected: list[str] = []
    for word in words:
        stands_alone = re.fullmatch(r"[A-Za-z_][\w.]*=.+", word) and not (corrected and corrected[-1].startswith("--"))
        corrected += ["--set", word] if stands_alone else [word]
    return corrected


def _bad_number(error: Any, words: list[str]) -> str:
    """Return the answer to what is not the number that an option takes; "" where it is something else."""
    option = next((one for one in getattr(getattr(error, "param", None), "opts", ()) if one.startswith("--")), None)
    place = next((at for at, word in enumerate(words) if option and word.partition("=")[0] == option), None)
    if option is None or place is None or "integer" not in error.message:
        return ""
    _, equals, value = words[place].partition("=")
    value = value if equals else "".join(words[place + 1 : place + 2])
    number = _whole(value)
    if number is None:
        return f"{option} must be a whole number, such as {option} 100; got {shown(value)}"
    corrected = [*words[:place], option, str(number), *words[place + (1 if equals else 2) :]]
    return f"{option} must be a whole number; got {shown(value)}: {line(corrected)}"


def _whole(text: str) -> int | None:
    """Return the number that ``1e4``, ``10,000`` or ``10k`` means; None where that is not clear."""
    match = re.fullmatch(r"(\d[\d,_]*(?:\.\d+)?(?:e\d{1,2})?)([kKmM]?)", text)
    if match is None:
        return None
    number = float(re.sub("[,_]", "", match[1])) * {"": 1, "k": 1e3, "m": 1e6}[match[2].lower()]
    return int(number) if number.is_integer() else None


def _missing(error: Any, words: list[str], known: list[str]) -> str:
    """Return the answer to a line in which something is missing, with that filled in by an example."""
    name, given = getattr(error.param, "name", ""), _positional(words, error.ctx)
    arguments = [one.name for one in error.ctx.command.params if one.param_type_name == "argument"]
    path = error.ctx.command_path.split()[1:]
    if name == "env" and "--env" in known:
        more = given[len(arguments) :]
        rest = [word for word in words if word not in more]
        return f"the environment is given by --env: {line([*rest, '--env', *(more or [_EXAMPLES[name]])])}"
    if name not in arguments:
        return f"{error.format_message().rstrip('.')}: `tuckerl {' '.join(path)} --help` tells of it"
    options = words[len(path) :]
    for word in given:
        options.remove(word)
    missing = [_EXAMPLES.get(one, one.upper()) for one in arguments[len(given) :]]
    corrected = [*path, *given, *missing, *options]
    return f"the {_WORDS.get(name, name)} is missing, as in {line(corrected)}"


_EXAMPLES = {"algorithm": "q-learning", "base": "q-learning", "candidate": "sarsa", "env": "FrozenLake-v1"}
_EXAMPLES |= {"file": "FILE", "folder": "DIR", "place": "DIR"}
_WORDS = {"env": "environment", "base": "first algorithm", "candidate": "second algorithm", "place": "folder or file"}


def _positional(words: list[str], ctx: Any) -> list[str]:
    """Return the words of a line that are neither commands nor options nor what options take."""
    flags = {name for one in ctx.command.params if getattr(one, "is_flag", False) for name in one.opts}
    found, rest = [], words[len(ctx.command_path.split()) - 1 :]
    while rest:
        word, *rest = rest
        if not word.startswith("-"):
            found.append(word)
        elif "=" not in word and word not in flags:
            rest = rest[1:]
    return found


def _unknown_command(words: list[str]) -> str:
    """Return the answer to a command that there is none of; "" where nothing is like it."""
    from pathlib import Path

    from tuckerl.cli import COMMANDS

    if words[:1] == ["study"] and len(words) > 1:
        place = Path(words[1])
        if place.suffix == ".toml":
            return f"study needs to be told what to do: {line(['study', 'run', *words[1:]])}"
        if place.is_dir():
            return f"study needs to be told what to do: {line(['study', 'status', *words[1:]])}"
        close = did_you_mean(words[1], ("run", "resume", "status", "report", "export"))
        return f"there is no command study {words[1]}: {close or '`tuckerl study --help` shows those that there are'}"
    name = words[0] if words else ""
    meant = _COMMANDS.get(name)
    if meant is not None:
        return f"there is no command {name}: {line([*meant.split(), *words[1:]])}"
    close = did_you_mean(name, COMMANDS)
    return f"there is no command {name}: {close or '`tuckerl --help` shows those that there are'}"
