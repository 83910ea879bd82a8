"""What type checkers are told of the package: ``src/tuckerl/__init__.pyi``, written from the registers.

Names are found when they are first asked for, which no type checker follows. ``make format`` writes the file anew.
"""

from pathlib import Path

import tuckerl

STUB = Path(tuckerl.__file__).with_suffix(".pyi")


def stub_text() -> str:
    """Return what the file is to hold."""
    homes = tuckerl._HOMES | {"__version__": "tuckerl._version", "errors": "tuckerl", "testing": "tuckerl"}
    imports = [f"from {home} import {name} as {name}\n" for home, name in sorted((h, n) for n, h in homes.items())]
    names = "".join(f'    "{name}",\n' for name in sorted(tuckerl.__all__, key=_place))
    head = "# Written by `make format` from the registers.\n\n"
    return f"{head}{''.join(imports)}\n__all__ = [\n{names}]\n_HOMES: dict[str, str]\n"


def _place(name: str) -> tuple[bool, bool, str]:
    """Return where the linter wants a name: those in capitals first, then classes."""
    return not name.isupper(), not name[0].isupper(), name


if __name__ == "__main__":
    STUB.write_text(stub_text())
