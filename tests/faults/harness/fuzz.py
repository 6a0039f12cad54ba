"""Commands on broken inputs and with odd options: each ends well, or in one line that names the cause."""

from pathlib import Path
from random import Random

import click
from ogmkit_cli.main import main

from harness import outcome
from harness.broken import Broken
from harness.cases import Bench
from harness.faults import Tally
from harness.forked import Ended
from harness.scenarios import SCENARIOS, Scenario

_VALUES = (
    *(
        "",
        "0",
        "-1",
        "1",
        "2",
        "0.5",
        "1e-9",
        "1e9",
        "nan",
        "inf",
        "-inf",
        "1000000000",
        "99999999999999999999",
    ),
    *(
        "a",
        "a,b",
        ",",
        "*",
        "[",
        "scene-0001",
        "CAM_FRONT",
        "1x1",
        "0x0",
        "64x96",
        "x",
        "..",
        ".",
        "/dev/null",
    ),
    *(
        "/dev/full",
        "/proc/1/mem",
        "absent/file",
        "é",
        "\udc80",
        "=",
        "--",
        "-",
        "a" * 5000,
        "surface",
        "train",
    ),
)
_LEFT_OUT = {
    *("--workers", "--devices", "--num-scenes", "--frames", "--epochs", "--max-steps", "--samples", "--help"),
    *("--verbose", "--log-file"),
}
"""Options of which odd values only take long or take the machine, and those that add lines to stderr."""


class Fuzz:
    """Runs broken cases of one process."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench

    def broken(self, kind: Broken, seed: str, tally: Tally) -> None:
        """One broken file, read by one command."""
        random = Random(seed)
        scenario = SCENARIOS[random.choice(kind.readers)]
        sound = self._bench.sound(scenario)
        self._bench.fresh(scenario)
        path = random.choice(sorted(self._bench.case.glob(kind.files)))
        way = random.choice(kind.ways)
        way(path, random)
        named = {*outcome.names_of(sound[1]), *scenario.names, path.name, path.stem, *_paths_in(path)}
        ended = self._bench.forker.command(scenario.arguments)
        found = outcome.of_end(ended, named)
        if found == outcome.OK:
            found = self._result(kind, scenario, ended, sound)
        tally.add(f"{kind.name}: {seed}: {scenario.name}, {path.name} by {way.__name__}", found, ended)

    def options(self, name: str, seed: str, tally: Tally) -> None:
        """One command with one to three odd options."""
        random = Random(seed)
        scenario = SCENARIOS[name]
        sound = self._bench.sound(scenario)
        self._bench.fresh(scenario)
        extra: list[str] = []
        for _ in range(random.choice((1, 1, 2, 3))):
            extra += _option(scenario, random)
        ended = self._bench.forker.command((*scenario.arguments, *extra))
        options = [part.lstrip("-") for part in extra if part.startswith("--")]
        named = [*options, *(option.replace("-", "_") for option in options)]
        named += [repr(part)[1:-1] for part in extra]  # as messages show what can't be printed
        found = outcome.of_end(
            ended, {*outcome.names_of(sound[1]), *scenario.names, *named, *filter(None, extra)}
        )
        shown = " ".join(part[:40] for part in extra)
        tally.add(f"options: {seed}: {scenario.name} {shown!r}", found, ended)

    def _result(
        self, kind: Broken, scenario: Scenario, ended: Ended, sound: tuple[Ended, dict[str, str]]
    ) -> str:
        """Of a run that succeeded: its result is sound, as far as that can be told."""
        if kind.checked:
            made = {
                path: digest
                for path, digest in self._bench.contents(scenario).items()
                if path not in _given(scenario, kind, self._bench.case)
            }
            wanted = {
                path: digest
                for path, digest in sound[1].items()
                if path not in _given(scenario, kind, self._bench.case)
            }
            return outcome.of_result(ended, made, sound[0], wanted, speaks=scenario.speaks)
        if scenario.verified and scenario.verified not in scenario.inputs:
            verified = self._bench.forker.command(("verify", scenario.verified))
            return outcome.OK if verified.code == 0 else outcome.WRONG
        return outcome.OK


def _paths_in(path: Path) -> set[str]:
    """What a YAML file says of other files: a good message may name these."""
    if path.suffix != ".yaml" or not path.is_file():
        return set()
    words = path.read_text(encoding="utf-8", errors="replace").split()
    return {word.strip("'\"") for word in words if "/" in word}


def _given(scenario: Scenario, kind: Broken, case: Path) -> set[str]:
    return {str(path.relative_to(case)) for path in case.glob(kind.files)}


def _option(scenario: Scenario, random: Random) -> list[str]:
    """An option of the scenario's command, with a value where it takes one."""
    command = main.get_command(click.Context(main), scenario.arguments[0])
    if isinstance(command, click.Group):
        command = command.get_command(click.Context(command), scenario.arguments[1])
    assert command is not None
    options = [
        one for one in command.params if isinstance(one, click.Option) and not set(one.opts) & _LEFT_OUT
    ]
    option = random.choice(options)
    flag = random.choice(option.opts)
    return [flag] if option.is_flag or option.count else [flag, random.choice(_VALUES)]
