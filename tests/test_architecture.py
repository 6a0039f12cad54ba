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


DOORS = {"ogmkit/base/files.py"}


@pytest.mark.parametrize("path", LIBRARY + COMMANDS, ids=relative)
def test_files_are_read_through_one_door(path):
    """`ogmkit.base.files` refuses pipes and devices, and bounds what is read."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    found = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    methods = [(node.func.attr, node) for node in found if isinstance(node.func, ast.Attribute)]
    reading = [node.lineno for name, node in methods if name in ("read_bytes", "read_text", "fromfile")]
    opening = [node.lineno for name, node in methods if name == "open" and opens_to_read(node)]
    assert relative(path) in DOORS or not reading + opening
    assert "open" not in calls(tree)


def opens_to_read(call):
    """Whether a call of `open` says no mode or one that reads only: `path.open()`, `path.open("rb")`."""
    modes = [one.value for one in call.args[:1] if isinstance(one, ast.Constant)]
    return not call.args or any(str(mode).startswith("r") for mode in modes)


def test_the_library_starts_without_anything_heavy():
    code = "import ogmkit, sys; dir(ogmkit); ogmkit.SampleSpec(), ogmkit.OgmkitError"
    report = f"{code}\nprint(*sorted({{name.split('.')[0] for name in sys.modules}}))"
    run = subprocess.run([sys.executable, "-c", report], capture_output=True, text=True, check=True)
    loaded = set(run.stdout.split())
    assert "ogmkit" in loaded
    assert not loaded & HEAVY
