"""What gets installed: an editable install hides what a wheel leaves out."""

import ast
import configparser
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import ogmkit

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def config():
    parser = configparser.ConfigParser()
    parser.read(ROOT / "setup.cfg", encoding="utf-8")
    return parser


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """A wheel built from a copy of the sources, so that nothing is written into the checkout."""
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    source.mkdir()
    for name in ("setup.cfg", "pyproject.toml", "DESCRIPTION.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    for name in ("ogmkit", "cli"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    build = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "--quiet",
        "--no-deps",
        "--no-build-isolation",
        "--no-index",
    ]
    subprocess.run([*build, "--wheel-dir", folder, source], check=True, stdin=subprocess.DEVNULL)
    (path,) = folder.glob("*.whl")
    with zipfile.ZipFile(path) as archive:
        yield archive


def list_of(config, section, key):
    return config[section][key].split()


LEARN = ROOT / "ogmkit" / "learn"


def third_party_imports(modules):
    """Top-level names that these modules import from elsewhere."""
    found = set()
    for module in modules:
        for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
                found.add(node.module.split(".")[0])
    return found - set(sys.stdlib_module_names) - {"ogmkit"}


def modules(*, learn):
    """Modules below `ogmkit/learn`, or all others of library and commands."""
    paths = [*(ROOT / "ogmkit").rglob("*.py"), *(ROOT / "cli").rglob("*.py")]
    return [path for path in paths if path.is_relative_to(LEARN) == learn]


def distributions(names):
    """The distributions that these top-level names come from."""
    known = {"rerun": ["rerun-sdk"]} | dict(metadata.packages_distributions())  # also where it is absent
    return {canonical(name) for top in names for name in known.get(top, [top])}


def canonical(name):
    return re.sub(r"[-_.]+", "-", name).lower()


def test_every_folder_is_listed_as_package(config):
    listed = set(list_of(config, "options", "packages"))
    folders = {path.parent.relative_to(ROOT) for path in (ROOT / "ogmkit").rglob("__init__.py")}
    assert listed == {".".join(folder.parts) for folder in folders} | {"ogmkit_cli"}


def test_no_module_lies_outside_a_package():
    for folder in {path.parent for name in ("ogmkit", "cli") for path in (ROOT / name).rglob("*.py")}:
        assert (folder / "__init__.py").exists(), f"{folder} has modules and no __init__.py"


def test_wheel_holds_every_module_and_nothing_else(wheel):
    modules = {path.relative_to(ROOT).as_posix() for path in (ROOT / "ogmkit").rglob("*.py")}
    modules |= {f"ogmkit_cli/{path.name}" for path in (ROOT / "cli").glob("*.py")}
    parts = {f"ogmkit/report/report.{ending}" for ending in ("css", "js")}
    packed = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert packed == modules | parts | {"ogmkit/py.typed"}


def test_wheel_carries_licence_and_console_script(wheel):
    (licence,) = (name for name in wheel.namelist() if name.endswith("/LICENSE"))
    assert wheel.read(licence) == (ROOT / "LICENSE").read_bytes()
    (scripts,) = (name for name in wheel.namelist() if name.endswith("/entry_points.txt"))
    assert "ogmkit = ogmkit_cli.main:main" in wheel.read(scripts).decode().splitlines()


def test_installed_version_and_script_are_these():
    assert metadata.version("ogmkit") == ogmkit.__version__
    (script,) = metadata.entry_points(group="console_scripts", name="ogmkit")
    assert script.load().name == "main"


def required(config, *extras):
    lines = _lines(config["options"]["install_requires"])
    lines += [line for extra in extras for line in _lines(config["options.extras_require"][extra])]
    return {canonical(Requirement(line).name) for line in lines}


def test_core_imports_its_requirements_and_four_of_the_extras(config):
    imported = distributions(third_party_imports(modules(learn=False)))
    assert imported <= required(config, "parquet", "view", "cluster", "remote")


def test_learn_imports_the_core_and_its_extras(config):
    imported = third_party_imports(modules(learn=True))
    if any(name not in metadata.packages_distributions() for name in imported):
        pytest.skip("not installed: pip install 'ogmkit[train,onnx]'")
    assert distributions(imported) <= required(config, "train", "onnx")


def test_the_sdist_has_every_file(tmp_path):
    if not (ROOT / ".git").exists() or shutil.which("git") is None:
        pytest.skip("no clone: git says which files there are")
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True)
    names = {name for name in listed.stdout.split("\0") if name and (ROOT / name).exists()}
    for name in names:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    code = "import setuptools.build_meta as b; b.build_sdist('dist')"
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True, capture_output=True)
    (archive,) = (tmp_path / "dist").glob(f"ogmkit-{ogmkit.__version__}.tar.gz")
    with tarfile.open(archive) as packed:
        found = {name.partition("/")[2] for name in packed.getnames()}

    assert len(names) > 1000
    assert names - found == set()


def test_the_description_for_an_index_leads_nowhere_relative(wheel):
    (metadata_file,) = (name for name in wheel.namelist() if name.endswith("/METADATA"))
    shown = wheel.read(metadata_file).decode()
    description = (ROOT / "DESCRIPTION.md").read_text(encoding="utf-8")

    assert description.strip() in shown
    assert [link for link in re.findall(r"\]\(([^)]+)\)", description) if "://" not in link] == []
    assert "License-Expression: Apache-2.0" in shown
    assert "Author: ogmkit contributors" in shown


def test_the_oldest_releases_are_the_lower_bounds_of_the_core(config):
    lines = _lines((ROOT / "constraints-oldest.txt").read_text(encoding="utf-8"))
    pins = dict(line.split("==") for line in lines if line[0] != "#")
    for requirement in map(Requirement, _lines(config["options"]["install_requires"])):
        (bound,) = requirement.specifier
        assert bound.operator == ">="
        pinned = pins.pop(requirement.name)
        assert f"{pinned}.".startswith(f"{bound.version}."), requirement
    assert pins == {}


def test_constraints_pin_every_requirement(config):
    extras = config["options.extras_require"]
    lines = [
        line for lines in (config["options"]["install_requires"], *extras.values()) for line in _lines(lines)
    ]
    pins = dict(line.split("==") for line in _lines((ROOT / "constraints.txt").read_text()) if line[0] != "#")
    pins = {canonical(name): version for name, version in pins.items()}
    for requirement in map(Requirement, lines):
        assert requirement.specifier.contains(pins[canonical(requirement.name)]), requirement


def _lines(text):
    return [line.strip() for line in text.splitlines() if line.strip()]
