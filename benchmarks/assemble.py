"""Put the tables of the benchmarks in parts into RESULTS.md and docs/scaling.md, between their markers.

`python benchmarks/assemble.py`; what has not been run is called so.
"""

import argparse
import sys
from pathlib import Path

import cost_model
import learn_tables
import plan_tables
import real_tables
import scale_tables
from bench_command import RESULTS
from bench_parts import Bench
from result_rows import state

HERE = Path(__file__).resolve().parent
PAGE, SCALING = HERE / "RESULTS.md", HERE.parent / "docs" / "scaling.md"
TABLES = {
    "python benchmarks/perception.py": learn_tables,
    "python benchmarks/planning.py": plan_tables,
    "python benchmarks/scale.py": scale_tables,
}

COST_TABLES = {
    "constants": cost_model.constants_table,
    "checks": cost_model.checks_table,
    "carried on": cost_model.carried_on_table,
}


def main(arguments=None):
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--results", type=Path, default=RESULTS, help="where the parts' figures are")
    parser.add_argument("--page", type=Path, default=PAGE, help="the file with the markers")
    parser.add_argument("--scaling", type=Path, default=SCALING, help="the page on scaling")
    options = parser.parse_args(arguments)
    page = options.page.read_text(encoding="utf-8")
    for command, tables in TABLES.items():
        bench = Bench(options.results, options.results / tables.NAME, tuple(tables.parts_of(toy=False)))
        page = between(page, tables.NAME, f"{state(bench, command)}\n\n{tables.text(bench)}")
    page = between(page, real_tables.NAME, real_tables.text(options.results))
    options.page.write_text(page, encoding="utf-8")
    page = options.scaling.read_text(encoding="utf-8")
    bench = Bench(
        options.results, options.results / scale_tables.NAME, tuple(scale_tables.parts_of(toy=False))
    )
    for name, table in COST_TABLES.items():
        page = between(page, name, table(bench))
    options.scaling.write_text(page, encoding="utf-8")


def between(page, name, text):
    """A page with the text between the markers of a name.

    Raises:
        SystemExit: it lacks them.
    """
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    before, found, rest = page.partition(begin)
    _, closed, after = rest.partition(end)
    if not (found and closed):
        sys.exit(f"{begin} or {end} is missing")
    return f"{before}{begin}\n{text}\n{end}{after}"


if __name__ == "__main__":
    main()
