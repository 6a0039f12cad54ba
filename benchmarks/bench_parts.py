"""Benchmarks in parts: each is made once, tells its figures in a file, and resumes where it was cut short."""

import contextlib
import hashlib
import json
import os
import platform
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import Any

from ogmkit.base.atomic import replacing

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("ogmkit", "numpy", "opencv-python-headless", "torch", "segmentation-models-pytorch")


@dataclass(frozen=True)
class Part:
    """One part.

    Attributes:
        name: `group/what`, with the seed at its end where it has one.
        minutes: how long it takes on one core, by short runs.
        settings: all that its figures depend on, as plain values.
        make: called with the bench and the part; makes its files and gives its figures, as plain values.
        needs: names of the parts whose files it reads.
    """

    name: str
    minutes: float
    settings: Mapping[str, Any]
    make: Callable[["Bench", "Part"], Mapping[str, Any]]
    needs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Bench:
    """Parts and what is there of them.

    Attributes:
        folder: where data and runs are kept.
        results: where the parts' figures are kept; they are all that a table needs.
        parts: in the order that they are to be made in; each after those that it needs.
    """

    folder: Path
    results: Path
    parts: tuple[Part, ...] = field(repr=False)

    def part(self, name):
        """The part of this name."""
        return next(one for one in self.parts if one.name == name)

    def key(self, name):
        """What a part's settings, and those of the parts that it needs, come to."""
        part = self.part(name)
        content = [part.name, part.settings, *map(self.key, part.needs)]
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:12]

    def at(self, name):
        """The folder of a part's files; another one for other settings."""
        return self.folder / f"{name}-{self.key(name)}"

    def record(self, name):
        """What a part has told, by these settings; None where it hasn't."""
        return self._read(self._record_file(name), name)

    def is_made(self, name):
        """Whether a part's files are there."""
        return self._read(self._made_file(name), name) is not None

    def missing(self, only=()):
        """Names of the parts to make, in order: those without figures, and those whose files they read.

        Args:
            only: beginnings of names; none means all.
        """
        wanted = {
            one.name
            for one in self.parts
            if self.record(one.name) is None and (not only or one.name.startswith(tuple(only)))
        }
        for one in reversed(self.parts):
            if one.name in wanted:
                wanted |= {name for name in one.needs if not self.is_made(name)}
        return [one.name for one in self.parts if one.name in wanted]

    def make(self, name):
        """Make a part in this process, and keep what it tells."""
        part, place = self.part(name), self.at(name)
        resumed = place.exists()
        place.mkdir(parents=True, exist_ok=True)
        started, busy = time.monotonic(), _cpu_s()
        figures = part.make(self, part)
        times = {"wall_s": round(time.monotonic() - started, 1), "cpu_s": round(_cpu_s() - busy, 1)}
        told = {"part": name, "key": self.key(name), "settings": part.settings, **_origin(), **times}
        record = {**told, "resumed": resumed, "figures": figures}
        # Figures made before stay as they are: only the files were missing.
        if self.record(name) is None:
            _write(self._record_file(name), record)
        _write(self._made_file(name), {"key": self.key(name)})

    def _record_file(self, name):
        return self.results / f"{name}.json"

    def _made_file(self, name):
        return self.at(name) / "made.json"

    def _read(self, path, name):
        with contextlib.suppress(FileNotFoundError, json.JSONDecodeError):
            found = json.loads(path.read_text(encoding="utf-8"))
            return found if found["key"] == self.key(name) else None
        return None


def _write(path, content):
    """A JSON object, a key a line."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = ",\n".join(f"{json.dumps(key)}: {json.dumps(value)}" for key, value in content.items())
    with replacing(path) as part:
        part.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")


def _cpu_s():
    """Seconds of a core that this process and those it has started have used."""
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(one.ru_utime + one.ru_stime for one in used)


def _origin():
    """What code and machine figures are from."""
    versions = {name: metadata.version(name) for name in PACKAGES}
    changed = _git("status", "--porcelain", "--untracked-files=no", "--", "ogmkit", "cli", "benchmarks/*.py")
    return {
        "commit": _git("rev-parse", "HEAD"),
        "changed_since_commit": bool(changed),
        "versions": {"python": platform.python_version(), **versions},
        "machine": {"processor": platform.machine(), "cores": os.cpu_count()},
    }


def _git(*arguments):
    """What git prints; empty where the code is in no repository."""
    command = ["git", "-C", str(ROOT), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()


def say(*words):
    print(*words, file=sys.stderr, flush=True)
