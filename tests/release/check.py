"""Checks what would be released: `make release-check`.

Builds sdist and wheel of the files that git lists, and installs each in a new environment of every Python
from 3.11 on that is found, from the index that pip is set to. There it runs docs/first-hour.md as it is
written, but for training: this script's own Python does that with its torch, which a .pth file lends.
Last, the page and the tests of exact modules run on the oldest Python with the releases of
constraints-oldest.txt. Each line begins with the minutes since the start.
"""

import argparse
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = "docs/first-hour.md"
LOCK, PINS = ROOT / "constraints.txt", ROOT / "constraints-oldest.txt"
BEGAN = time.monotonic()
PARTS = ("built", "torch", "oldest", "installed")
OLDEST = (3, 11)
NEWEST_TRIED = 15
MADE = ("world", "shards/manifest.json", "pictures", "report.html")
EXACT = [
    *(f"tests/{name}" for name in ("geometry", "raster", "shards", "homography", "footprints", "nuscenes")),
    *(f"tests/{name}.py" for name in ("test_grid", "test_frames", "test_targets", "cli/test_main")),
]
TESTERS = ("pytest>=8.0", "pytest-xdist>=3.6", "hypothesis>=6.100", "scipy>=1.11", "packaging>=23.0")


def main() -> None:
    """Build, install, run; ends with 1 where something fails."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("--only", choices=PARTS, action="append")
    options.add_argument("--python", action="append", help="such as 3.12; default: all that are found")
    chosen = options.parse_args()
    parts = chosen.only or list(PARTS)
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        sdist, wheel = build(work)
        found = dict(found_pythons())
        pythons = {version: path for version, path in found.items() if version in (chosen.python or found)}
        if not pythons:
            sys.exit(f"None of the Pythons asked for is here: {', '.join(found) or 'none is found'}")
        say(f"Pythons: {', '.join(run([path, '--version'], work).split()[-1] for path in pythons.values())}")
        if "torch" in parts:
            with_torch(work, wheel)
        if "oldest" in parts:
            oldest(work, sdist, next(iter(pythons.values())))
        if "installed" in parts:
            for version, python in pythons.items():
                for archive in (wheel, sdist):
                    own = first_hour(work / f"{version}-{archive.suffix[1:]}", python, archive, [])
                    say(f"Python {version}, {archive.name}: the first hour without torch is sound")
                say(f"Python {version}: unlike {LOCK.name}: {', '.join(unlike(own, LOCK)) or 'nothing'}")
        untried = ", ".join(sorted(set(classified()) - set(pythons))) or "none"
        say(f"Parts done: {', '.join(parts)}; Pythons of the classifiers that were not tried: {untried}")


def build(work: Path) -> tuple[Path, Path]:
    """Sdist and wheel of the files that git lists; the sdist has all of them."""
    source = work / "source"
    listed = run(["git", "ls-files", "-z"], ROOT).split("\0")[:-1]
    for name in listed:
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, source / name)
    code = f"import setuptools.build_meta as b; b.build_sdist({str(work)!r}); b.build_wheel({str(work)!r})"
    run([sys.executable, "-c", code], source)
    (sdist,), (wheel,) = work.glob("*.tar.gz"), work.glob("*.whl")
    with tarfile.open(sdist) as archive:
        packed = {name.partition("/")[2] for name in archive.getnames()}
    missing = set(listed) - packed
    if missing:
        sys.exit(f"{sdist.name} lacks {', '.join(sorted(missing)[:9])}")
    say(f"{sdist.name} has all {len(listed)} files; {wheel.name}, {wheel.stat().st_size / 1e6:.1f} MB")
    return sdist, wheel


def found_pythons() -> Iterator[tuple[str, str]]:
    """Versions from the oldest on, each with its program: on PATH, or pyenv's."""
    for minor in range(OLDEST[1], NEWEST_TRIED):
        version = f"{OLDEST[0]}.{minor}"
        places = [
            shutil.which(f"python{version}"),
            *Path.home().glob(f".pyenv/versions/{version}.*/bin/python{version}"),
        ]
        for place in filter(None, places):
            asked = subprocess.run(
                [place, "-c", "import ensurepip, sys; print(sys.executable, '%d.%d' % sys.version_info[:2])"],
                capture_output=True,
                text=True,
                check=False,
            )
            program, _, found = asked.stdout.strip().rpartition(" ")
            if asked.returncode == 0 and found == version:
                yield version, program  # not the shim that starts it, which chooses by its name
                break


def classified() -> list[str]:
    """Versions that the package's classifiers name."""
    return re.findall(r"Python :: (3\.\d+)$", (ROOT / "setup.cfg").read_text("utf-8"), re.MULTILINE)


def blocks(language: str, until: str) -> list[str]:
    """Blocks of the page before a heading."""
    text = (ROOT / PAGE).read_text("utf-8").partition(until)[0]
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def first_hour(folder: Path, python: str, archive: Path, further: Iterable[str], **variables: str) -> str:
    """Run the page in a folder, the unpacked sdist or an empty one for a wheel; its environment's Python."""
    tools = folder / "tools"
    tools.mkdir(parents=True)
    (tools / "python3").symlink_to(python)
    place = folder / "here"
    place.mkdir()
    if archive.suffix == ".gz":
        with tarfile.open(archive) as packed:
            packed.extractall(folder, filter="data")
        place = folder / archive.name.removesuffix(".tar.gz")
    script = "\n".join([*blocks("sh", "\n## Train"), *further])
    if archive.suffix == ".whl":
        script = script.replace("pip install .\n", f"pip install {archive}\n")
    variables |= {
        "PATH": f"{tools}:{os.environ['PATH']}",
        "PIP_QUIET": "1",
        "OGMKIT_CACHE_DIR": str(folder / "cache"),
    }
    run(["bash", "-euc", script], place, **variables)
    absent = [name for name in MADE if not (place / name).exists()]
    if absent:
        sys.exit(f"{place}: the page did not make {', '.join(absent)}")
    own = str(place / "env/bin/python")
    for block in blocks("python", "\n## Train"):
        run([own, "-c", block], place)
    return own


def unlike(python: str, pins: Path) -> list[str]:
    """Distributions of an environment that are not of the release that a file pins."""
    listed = run([python, "-m", "pip", "list", "--format=freeze", "--exclude", "ogmkit"], ROOT).split()
    installed = dict(line.split("==") for line in listed)
    pinned = dict(line.split("==") for line in pins.read_text("utf-8").split() if "==" in line)
    return [
        f"{name} {version} ({pinned[name]})"
        for name, version in installed.items()
        if pinned.get(name, version) != version
    ]


def with_torch(work: Path, wheel: Path) -> None:
    """The page with its trainings, by this Python, which lends its torch."""
    torch = importlib.util.find_spec("torch")
    if torch is None or torch.origin is None:
        say("With torch: untested, this Python has none")
        return
    (block,) = set(blocks("sh", "\n## Go on")) - set(blocks("sh", "\n## Train"))
    # After the environment's own packages, so that the wheel is tested and what it brings.
    packages = f"env/lib/python3.{sys.version_info.minor}/site-packages"
    lent = f"echo {Path(torch.origin).parents[1]} > {packages}/lent.pth\n"
    trained = block.replace("pip install '.[train]'\n", lent)
    first_hour(work / "torch", os.path.realpath(sys.executable), wheel, [trained])
    say(f"Python {sys.version.split()[0]}, {wheel.name}: the first hour with trainings is sound")


def oldest(work: Path, sdist: Path, python: str) -> None:
    """The page, and tests of exact modules, with the lower bounds of the core."""
    own = first_hour(work / "oldest-hour", python, sdist, [], PIP_CONSTRAINT=str(PINS))
    if unlike(own, PINS):
        sys.exit(f"{PINS.name} was not installed: {', '.join(unlike(own, PINS))}")
    say(f"{PINS.name}: the first hour without torch is sound")
    folder = work / "oldest"
    run([python, "-m", "venv", str(folder)], work)
    own = str(folder / "bin/python")
    run([own, "-m", "pip", "install", "-q", "-c", str(PINS), str(sdist), *TESTERS], work)
    with tarfile.open(sdist) as packed:
        packed.extractall(work / "unpacked", filter="data")
    (source,) = (work / "unpacked").iterdir()
    for name in ("ogmkit", "cli"):
        shutil.rmtree(source / name)  # what is installed is tested
    shown = run([own, "-m", "pytest", "-q", "-p", "no:cacheprovider", *EXACT], source, OMP_NUM_THREADS="1")
    say(f"{PINS.name}: {shown.strip().splitlines()[-1]}")


def run(command: list[str], folder: Path, **variables: str) -> str:
    """Run a command; where it fails, show what it wrote and end."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"} | variables
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(
            f"{folder}: {command[0]} ended with {done.returncode}\n{done.stdout[-3000:]}{done.stderr[-5000:]}"
        )
    return done.stdout


def say(line: str) -> None:
    """Tell what is done."""
    print(f"{(time.monotonic() - BEGAN) / 60:4.0f}  {line}", flush=True)


if __name__ == "__main__":
    main()
