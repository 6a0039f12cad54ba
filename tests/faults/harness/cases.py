"""A working folder in which a command is run again and again, each time on fresh copies of its inputs."""

import hashlib
import importlib
import shutil
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from harness.forked import Ended, Forker
from harness.patched import PatchedInjector
from harness.scenarios import TEMPLATES, Scenario
from harness.shim import Injector

_UNCOMPARED = ("tensorboard", "decoding.lock", "lock")
"""Parts of paths whose files hold times, or nothing."""
_LONGEST_S = 600
"""Of a run that is not disturbed."""


class Bench:
    """Templates and the case's folder, under one folder of this process."""

    def __init__(self, folder: Path, injector: Injector | PatchedInjector) -> None:
        self._templates = folder / "templates"
        self._templates.mkdir(parents=True, exist_ok=True)
        self.forker = Forker(folder, injector)
        self.case = self.forker.case
        self._sound: dict[str, tuple[Ended, dict[str, str]]] = {}

    def template(self, name: str) -> Path:
        """A template, made in a child where it isn't there yet."""
        path = self._templates / name
        if not path.exists():
            needed, make = TEMPLATES[name]
            for other in needed:
                self.template(other)
            self.case.mkdir(exist_ok=True)
            ended = self._importing(lambda: make(self._templates))
            if ended.code != 0:
                raise RuntimeError(f"template {name}: {ended.stderr}")
        return path

    def fresh(self, scenario: Scenario) -> None:
        """The case's folder with the scenario's inputs as they were."""
        shutil.rmtree(self.case, ignore_errors=True)
        self.case.mkdir()
        for name in scenario.inputs:
            template = self.template(name)
            if template.is_dir():
                shutil.copytree(template, self.case / name)
            else:
                shutil.copy2(template, self.case / name)

    def contents(self, scenario: Scenario) -> dict[str, str]:
        """Checksums of the files in the case's folder, by path."""
        paths = [path for path in sorted(self.case.rglob("*")) if path.is_file()]
        return {
            name: hashlib.sha256(path.read_bytes()).hexdigest()
            for path in paths
            if not set(path.parts) & set(_UNCOMPARED)
            and (name := str(path.relative_to(self.case))) not in scenario.uncompared
        }

    def sound(self, scenario: Scenario) -> tuple[Ended, dict[str, str]]:
        """An undisturbed run, done once; what it imports is imported here, so that later children have it.

        Raises:
            RuntimeError: it fails.
        """
        if scenario.name not in self._sound:
            self._sound[scenario.name] = self._run_sound(scenario)
        return self._sound[scenario.name]

    def _run_sound(self, scenario: Scenario) -> tuple[Ended, dict[str, str]]:
        self.fresh(scenario)
        ended = self._importing(lambda: self.forker.run_ogmkit(scenario.arguments))
        if ended.code != 0:
            raise RuntimeError(f"{scenario.name}: undisturbed, it ends with {ended}")
        return ended, self.contents(scenario)

    def _importing(self, function: Callable[[], object]) -> Ended:
        """Run a function in a child, and import here what it imports, for the children to come."""
        listed = self.case.parent / "modules"

        def run() -> None:
            try:
                function()
            finally:
                listed.write_text("\n".join(sys.modules))

        ended = self.forker.call(run, kill_after_s=_LONGEST_S)
        for name in listed.read_text().splitlines():
            with suppress(Exception):
                importlib.import_module(name)
        return ended
