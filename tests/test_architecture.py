"""What the import contract can't hold: what importing costs, and what library code never does."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
LIBRARY = sorted((ROOT / "ogmkit").rglob("*.py"))
COMMANDS = sorted((ROOT / "cli").rglob("*.py"))
TORCH = ROOT / "ogmkit" / "torch.py"
LONGEST_MODULE = 250
HEAVY = {"numpy", "cv2", "duckdb", "h5py", "shapely", "pyquaternion", "PIL", "tqdm", "torch"}


def relative(path):
    return str(path.relative_to(ROOT))


def calls(tree):
    """Names of the plain functions that a module calls."""
    nodes = (node for node in ast.walk(tree) if isinstance(node, ast.Call))
    return {node.func.id for node in nodes if isinstance(node.func, ast.Name)}


@pytest.mark.parametrize("path", LIBRARY + COMMANDS, ids=relative)
def test_modules_are_short_and_hold_no_assert(path):
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= LONGEST_MODULE
    asserts = [node.lineno for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Assert)]
    assert not asserts, f"asserts vanish under -O: lines {asserts}"


@pytest.mark.parametrize("path", LIBRARY, ids=relative)
def test_library_never_prints_asks_or_exits(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    assert not calls(tree) & {"print", "input", "exit", "quit"}
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    assert "SystemExit" not in names
    imported = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    assert not imported & {"argparse", "logging.config"}


def imported_names(path):
    """(module, name) of each `from module import name`."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    froms = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    return {(node.module, alias.name) for node in froms for alias in node.names}


@pytest.mark.parametrize("path", LIBRARY, ids=relative)
def test_rooms_do_not_go_through_the_public_face(path):
    found = imported_names(path)
    assert {name for module, name in found if module == "ogmkit"} <= {"__version__"}
    assert not {name for module, name in found if module == "ogmkit.torch"}


def test_the_face_for_torch_only_re_exports_samples():
    tree = ast.parse(TORCH.read_text(encoding="utf-8"))
    docstring, *imports, names = tree.body
    assert isinstance(docstring, ast.Expr)
    assert {node.module.rsplit(".", 1)[0] for node in imports} == {"ogmkit.learn.data", "ogmkit.samples"}
    assert [target.id for target in names.targets] == ["__all__"]


@pytest.mark.parametrize("path", COMMANDS, ids=relative)
def test_commands_import_each_other_relatively(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    absolute = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and not node.level}
    assert not {name for name in absolute if name and name.split(".")[0] in {"cli", "ogmkit_cli"}}


def modules_after(code):
    report = f"{code}\nimport sys\nprint(*sorted({{name.split('.')[0] for name in sys.modules}}))"
    run = subprocess.run([sys.executable, "-c", report], capture_output=True, text=True, check=True)
    return set(run.stdout.splitlines()[-1].split())


@pytest.mark.parametrize(
    "code",
    [
        "import ogmkit; dir(ogmkit); ogmkit.SampleSpec(), ogmkit.OgmkitError",
        "from ogmkit_cli.main import main; main(['--help'], standalone_mode=False)",
        "from ogmkit_cli.main import COMMANDS, main\n"
        "names = COMMANDS.keys() - {'extract', 'synthesize'}\n"
        "for name in names: main([name, '--help'], standalone_mode=False)",
    ],
    ids=["library", "help", "help-of-commands"],
)
def test_starts_without_anything_heavy(code):
    loaded = modules_after(code)
    assert "ogmkit" in loaded
    assert not loaded & HEAVY


@pytest.mark.parametrize("name", ["extract", "synthesize"])
def test_help_with_settings_of_arrays_needs_numpy_at_most(name):
    code = f"from ogmkit_cli.main import main; main([{name!r}, '--help'], standalone_mode=False)"
    assert not modules_after(code) & HEAVY - {"numpy"}
