"""`make mutants`: change the exact modules one place at a time, and see whether their own tests notice.

Resumable: outcomes are kept as they come, and hold as long as the module and its tests stay as they are.
"""

import argparse
import os
import re
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from listing import MODULES, ROOT, Mutant, mutants_of, sample, source_of
from report import Outcomes, Share, table
from trial import Copy

_LEAST_S, _SLOWER = 30.0, 10.0  # a mutant that takes so long, and so many times as long, has timed out


def main() -> int:
    """Try what the options say; 1 where the score is below the one wanted."""
    options = _options()
    sources = {module: (ROOT / source_of(module)).read_text(encoding="utf-8") for module in MODULES}
    mutants = [mutant for module, source in sources.items() for mutant in mutants_of(module, source)]
    chosen = mutants if options.all else sample(mutants, options.sample, options.seed)
    chosen = [mutant for mutant in chosen if re.search(options.only, mutant.module)]
    outcomes = Outcomes(options.out)
    try_all([mutant for mutant in chosen if outcomes.of(mutant) is None], outcomes, options.workers)
    shares = {
        module: Share.of([mutant for mutant in chosen if mutant.module == module], source, outcomes)
        for module, source in sources.items()
        if any(mutant.module == module for mutant in chosen)
    }
    outcomes.close(shares)
    print(table(shares, len(mutants)))
    return int(sum(shares.values(), Share()).score < options.wanted)


def try_all(mutants: list[Mutant], outcomes: Outcomes, workers: int) -> None:
    """Try mutants, module by module, each worker in a copy of its own."""
    with (
        tempfile.TemporaryDirectory(prefix="ogmkit-mutants-") as folder,
        ProcessPoolExecutor(workers, initializer=_make_copy, initargs=(Path(folder),)) as pool,
    ):
        modules = list(dict.fromkeys(mutant.module for mutant in mutants))
        limits_s = dict(zip(modules, pool.map(_limit_s, modules), strict=True))
        tries = pool.map(_try, mutants, [limits_s[mutant.module] for mutant in mutants])
        for number, (mutant, outcome) in enumerate(zip(mutants, tries, strict=True), 1):
            outcomes.add(mutant, outcome)
            print(
                f"{number}/{len(mutants)} {mutant.module}:{mutant.line} {mutant.name} {outcome}", flush=True
            )


_copy: Copy


def _make_copy(folder: Path) -> None:
    global _copy  # noqa: PLW0603 — of this worker
    _copy = Copy(folder / str(os.getpid()))


def _limit_s(module: str) -> float:
    return max(_LEAST_S, _SLOWER * _copy.seconds(module))


def _try(mutant: Mutant, limit_s: float) -> str:
    return _copy.outcome(mutant, limit_s)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sample", type=int, default=210, help="how many places are changed")
    parser.add_argument("--seed", type=int, default=0, help="of the sample")
    parser.add_argument("--all", action="store_true", help="try every mutant; takes hours")
    parser.add_argument("--only", default="", help="regular expression: only modules whose path matches")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes")
    parser.add_argument("--wanted", type=float, default=0.9, help="least share that is killed")
    parser.add_argument("--out", type=Path, default=ROOT / "benchmarks" / "results" / "mutants.json")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
