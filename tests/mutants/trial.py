"""One mutant tried: a copy of the checkout has it, and a forked process runs the module's own tests there."""

import importlib
import os
import resource
import shutil
import signal
import sys
import time
import traceback
from pathlib import Path

import hypothesis
import pytest
from listing import ROOT, Mutant, source_of, tests_of

_MEMORY = 8 << 30  # bytes that a mutant may ask for
_ELSEWHERE = 99  # exit code: the tests imported another ogmkit
_PREPARED = (
    "cv2",
    "h5py",
    "pyquaternion",
    "scipy.optimize",
    "scipy.spatial.transform",
    "scipy.stats",
    "shapely",
)
"""What is imported once, before the forks: imports take longer than most tests. Nothing of ogmkit's."""


_OPTIONS = (
    *("-x", "-q", "-p", "no:cacheprovider", "-n", "0", "--hypothesis-profile", "mutants"),
    *("-W", "ignore::pytest.PytestAssertRewriteWarning"),  # of what is imported before pytest begins
)


class Copy:
    """A copy of package, tests and settings, in which mutants come and go; the checkout is only read."""

    def __init__(self, folder: Path, root: Path = ROOT) -> None:
        self.folder = folder
        self.log = folder / "tests.log"
        for name in ("ogmkit", "cli", "tests"):
            shutil.copytree(root / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copy(root / "setup.cfg", folder)
        (folder / "fixtures").symlink_to(root / "fixtures")
        os.environ.setdefault("OGMKIT_TEST_DATA", str(root.parent / "shared" / "data"))
        os.environ["PYTHONPATH"] = str(folder)  # of what tests start
        for name in _PREPARED:
            importlib.import_module(name)
        # Examples are the same for all mutants; a failing one need not be made simple.
        phases = (hypothesis.Phase.explicit, hypothesis.Phase.generate)
        hypothesis.settings.register_profile(
            "mutants", deadline=None, derandomize=True, database=None, phases=phases
        )

    def seconds(self, module: str) -> float:
        """Run a module's own tests without a mutant.

        Raises:
            RuntimeError: they fail.
        """
        start = time.monotonic()
        if self._outcome(module, 600.0) != "survived":
            raise RuntimeError(f"{tests_of(module)} fails as it is:\n{self.log.read_text(encoding='utf-8')}")
        return time.monotonic() - start

    def outcome(self, mutant: Mutant, limit_s: float) -> str:
        """`killed`, `survived`, or `timed_out` where the tests take longer."""
        path = self.folder / source_of(mutant.module)
        source = path.read_text(encoding="utf-8")
        path.write_text(mutant.mutated(source), encoding="utf-8")
        try:
            return self._outcome(mutant.module, limit_s)
        finally:
            path.write_text(source, encoding="utf-8")

    def _outcome(self, module: str, limit_s: float) -> str:
        child = os.fork()
        if not child:
            self._run_tests(module)
        status, until = None, time.monotonic() + limit_s
        while status is None and time.monotonic() < until:
            time.sleep(0.02)
            ended, code = os.waitpid(child, os.WNOHANG)
            status = code if ended else None
        if status is None:
            os.killpg(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return "timed_out"
        if os.waitstatus_to_exitcode(status) == _ELSEWHERE:
            raise RuntimeError(f"{tests_of(module)} ran on another ogmkit than the copy in {self.folder}")
        return "killed" if status else "survived"

    def _run_tests(self, module: str) -> None:
        """Become pytest; never returns."""
        code = 1
        try:
            os.setsid()
            log = os.open(self.log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(log, 1)
            os.dup2(log, 2)
            resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
            os.chdir(self.folder)
            # Compiled files are told apart by time and size, and mutants are of one second and one size.
            sys.dont_write_bytecode = True
            sys.path.insert(0, str(self.folder))
            code = pytest.main([str(tests_of(module)), *_OPTIONS, "--basetemp", str(self.folder / "tmp")])
            home = Path(getattr(sys.modules.get("ogmkit"), "__file__", self.folder))
            code = code if home.is_relative_to(self.folder) else _ELSEWHERE
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)
