"""The shape of the package: layers look one way, the public surface is what it says, imports stay light."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import tuckerl
from tests.structure import stub

PACKAGE = Path(tuckerl.__file__).parent
GROUND = {
    "errors",
    "checks",
    "rng",
    "_jit",
    "_kernel_cache",
    "_kernel_compiler",
    "types",
    "files",
    "interrupts",
    "intervals",
    "memory",
    "progress",
    "registers",
    "saved_arrays",
    "saved_json",
    "_version",
}
LAYERS = (  # from the bottom; those of one line know nothing of each other
    ("tensor",),
    ("spaces",),
    ("problems",),
    ("generalization",),
    ("adapters", "environments"),
    ("solving",),
    ("training",),
    ("learners",),
    ("testing",),
    ("studies",),
    ("reports",),
    ("cli",),
)
HOME = re.compile(r"tuckerl(\.\w+)+(:\w+)?")
FOLDERS = {folder for layer in LAYERS for folder in layer}


def sources() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def layer_of(source: Path) -> str:
    return source.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imported_layers(source: Path) -> set[str]:
    """Return the layers of tuckerl that a file imports, wherever in it, or names as the homes of what it registers."""
    found = set()
    for node in ast.walk(ast.parse(source.read_text())):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            assert node.level == 0, f"{source}: imports are absolute"
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Constant) and HOME.fullmatch(str(node.value)):  # in a register
            names = [str(node.value)]
        found |= {name.split(".")[1] for name in names if name.startswith("tuckerl.")}
    return found & (FOLDERS | GROUND)


@pytest.mark.parametrize("source", sources(), ids=lambda s: s.relative_to(PACKAGE).as_posix())
def test_layers_import_only_those_below(source: Path) -> None:
    layer = layer_of(source)
    if layer in ("__init__", "__main__"):
        return
    allowed = set(GROUND)
    if layer not in GROUND:
        place = next(place for place, folders in enumerate(LAYERS) if layer in folders)
        allowed |= {layer, *(folder for folders in LAYERS[:place] for folder in folders)}
    assert imported_layers(source) <= allowed


def test_every_folder_is_a_layer() -> None:
    folders = {path.name for path in PACKAGE.iterdir() if path.is_dir() and path.name != "__pycache__"}
    modules = {path.stem for path in PACKAGE.glob("*.py")} - {"__init__", "__main__"}
    assert folders == FOLDERS
    assert modules == GROUND


@pytest.mark.parametrize(
    ("library", "home"),
    [
        ("numba", {"_jit", "_kernel_cache", "_kernel_compiler"}),
        ("matplotlib", {"reports"}),
        ("typer", {"cli"}),
        ("optuna", {"studies"}),
    ],
)
def test_heavy_libraries_have_one_home(library: str, home: set[str]) -> None:
    importers = {
        layer_of(source)
        for source in sources()
        for node in ast.walk(ast.parse(source.read_text()))
        for name in (
            [alias.name for alias in node.names]
            if isinstance(node, ast.Import)
            else [node.module or ""]
            if isinstance(node, ast.ImportFrom)
            else []
        )
        if name.split(".")[0] == library
    }
    assert importers == home


def test_all_is_what_is_public() -> None:
    assert tuckerl.__all__ == sorted(tuckerl.__all__)
    assert set(tuckerl.__all__) == set(dir(tuckerl))
    for name in tuckerl.__all__:
        assert getattr(tuckerl, name) is not None
    assert stub.STUB.read_text() == stub.stub_text(), "run `make format`: it writes what type checkers are told"


def test_every_public_thing_is_documented() -> None:
    for name in set(tuckerl.__all__) - {"__version__"}:
        assert (getattr(tuckerl, name).__doc__ or "").strip(), name


def test_an_unknown_attribute_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = tuckerl.nothing  # type: ignore[attr-defined]  # that is what is tested


def loaded_by(code: str) -> set[str]:
    """Return the top-level modules that a fresh interpreter has loaded after `code`."""
    script = f"{code}\nimport sys; print(*sorted({{name.split('.')[0] for name in sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


HEAVY = {"numba", "llvmlite", "matplotlib", "optuna", "polars", "scipy"}


def test_the_import_is_light() -> None:
    assert not loaded_by("import tuckerl") & HEAVY


def test_the_help_is_light() -> None:
    code = (
        "import tuckerl.cli\n"
        "for arguments in (['--help'], ['reproduce', '--help'], ['compare', '--help'], ['list', '--help'],\n"
        "                  ['train', '--help'], ['evaluate', '--help'], ['show', '--help'], ['study', '--help'],\n"
        "                  ['study', 'run', '--help'], ['study', 'export', '--help'], ['tune', '--help']):\n"
        "    try: tuckerl.cli.main(arguments)\n"
        "    except SystemExit as end: assert end.code == 0"
    )
    assert not loaded_by(code) & HEAVY


LONG = {
    # One class is one file: what users call, what authors override and what is shown, most of it documentation.
    "training/learner.py": 570,
    # All that is said to Numba: kernels, users' functions, and what is told to LLVM.
    "_jit.py": 395,
    # Its users' functions, the kernels that call them, and what of them is impossible.
    "problems/simulator.py": 370,
}


@pytest.mark.parametrize("source", sources(), ids=lambda s: s.relative_to(PACKAGE).as_posix())
def test_files_and_functions_stay_small(source: Path) -> None:
    text = source.read_text()
    longest = LONG.get(source.relative_to(PACKAGE).as_posix(), 350)
    assert text.count("\n") <= longest, "a file past 350 lines is usually more than one idea"
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef) and node.end_lineno:
            body = node.body[1:] if ast.get_docstring(node) else node.body
            assert not body or node.end_lineno - body[0].lineno < 40, f"{node.name} is longer than 40 lines"
