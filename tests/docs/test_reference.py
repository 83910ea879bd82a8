"""docs/reference names what there is, and all that authors of learners and policies need."""

import importlib
import re
from pathlib import Path
from typing import Any

import pytest

from tuckerl.training.learner import Learner
from tuckerl.training.policies.policy import Policy

DOCS = Path(__file__).parents[2] / "docs"
REFERENCE = "\n".join(page.read_text("utf-8") for page in sorted((DOCS / "reference").glob("*.md")))
ENTRY = re.compile(r"^\.\. auto\w+:: (?P<name>[\w.]+)\n(?P<options>(?:   :.*\n)*)", re.MULTILINE)


def found(name: str) -> Any:
    """Return what a full name stands for: a module's member, or a member of that."""
    parts = name.split(".")
    for n in range(len(parts), 0, -1):
        try:
            thing: Any = importlib.import_module(".".join(parts[:n]))
        except ModuleNotFoundError:
            continue
        for part in parts[n:]:
            declared = getattr(thing, "__annotations__", {})  # a class may leave the value to its subclasses
            thing = declared[part] if part in declared else getattr(thing, part)
        return thing
    raise AssertionError(name)


def entries() -> dict[str, tuple[str, ...]]:
    """Return the reference's names with the members that are listed for each."""
    listed = {}
    for entry in ENTRY.finditer(REFERENCE):
        members = re.search(r":members: (.+)", entry["options"])
        listed[entry["name"]] = tuple(members[1].split(", ")) if members else ()
    return listed


ATTRIBUTES = {"problem", "n_agents"}  # that a learner's constructor sets


@pytest.mark.parametrize("name", entries())
def test_what_is_listed_exists(name: str) -> None:
    thing = found(name)
    for member in entries()[name]:
        assert member in ATTRIBUTES or hasattr(thing, member), f"{name} has no {member}"


@pytest.mark.parametrize("kind", [Learner, Policy])
def test_all_public_members_of_what_authors_subclass_are_listed(kind: type) -> None:
    full = f"{kind.__module__}.{kind.__name__}"
    listed = set(entries()[full])
    listed |= {name.removeprefix(f"{full}.") for name in entries() if name.startswith(f"{full}.")}
    ours = [base for base in kind.__mro__ if base.__module__.startswith("tuckerl.")]
    public = {name for base in ours for name in vars(base) if not name.startswith("_")}
    assert public <= listed


def test_the_page_on_learners_uses_nothing_that_the_reference_does_not_have() -> None:
    page = (DOCS / "learners.md").read_text("utf-8")
    used = set()
    for module, names in re.findall(r"^from (tuckerl[\w.]*) import (\([^)]+\)|.+)$", page, re.MULTILINE):
        bare = [name.split(" as ")[0].strip() for name in names.strip("()").split(",")]
        used |= {f"{module}.{name}" for name in bare if name}
    used |= set(re.findall(r"\{\w+\}`~?([\w.]+)`", page))
    things = [found(name) for name in entries()]
    assert used
    for name in sorted(used):
        assert any(found(name) is thing for thing in things), f"{name} is in docs/learners.md and not in docs/reference"
