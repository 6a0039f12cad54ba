"""`ogmkit --help` against the same interpreter's barest Click group."""

import statistics
import sys
import tempfile
from pathlib import Path

from measure import run_process, show

RUNS = 25
BARE = """
import click

@click.group()
def main():
    "Bare."

main()
"""


def main():
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "bare.py"
        script.write_text(BARE, encoding="utf-8")
        commands = {
            "bare Click group": [sys.executable, str(script), "--help"],
            "ogmkit --help": [str(Path(sys.executable).with_name("ogmkit")), "--help"],
            "python -c 'import numpy'": [sys.executable, "-c", "import numpy"],
        }
        times = {name: [] for name in commands}
        for _ in range(RUNS):
            for name, command in commands.items():
                times[name].append(run_process(command)[0])
    medians = {name: statistics.median(values) for name, values in times.items()}
    bare = medians["bare Click group"]
    rows = [(name, f"{1e3 * value:.0f} ms", f"{value / bare:.2f}×") for name, value in medians.items()]
    show(f"Start of the command (median of {RUNS} runs; aim: ≤ 3×)", ("", "time", "ratio"), rows)


main()
