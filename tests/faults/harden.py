"""`make harden`: disturb every command, break every input, and count what comes of it.

Resumable: each part keeps its counts in a JSON file, and a run resumes with what is missing. `--sample` tries
a case of some quick parts instead and writes the counts to stdout, for the tests.
"""

import argparse
import fcntl
import json
import os
import random
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

HERE = Path(__file__).resolve().parent
RESULTS = HERE.parents[1] / "benchmarks" / "results" / "harden"
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def main() -> int:
    """Run what the options say; 1 where something came out badly."""
    options = _options()
    return _start(options) if options.worker is None else _work(options)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of the counts")
    parser.add_argument("--minutes", type=float, default=90, help="no case is begun after that")
    parser.add_argument("--only", default="", help="regular expression: only parts whose file's name matches")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--sample", type=int, help="try a case of so many quick parts; JSON to stdout")
    parser.add_argument("--seed", default="0", help="of the sample")
    parser.add_argument("--worker", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--scratch", type=Path, help=argparse.SUPPRESS)
    return parser.parse_args()


def _start(options: argparse.Namespace) -> int:
    """Start the workers with the injector before the C library, in a folder in memory where there is one."""
    from harness.shim import compile_shim
    from harness.table import details

    memory = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    with tempfile.TemporaryDirectory(prefix="ogmkit-harden-", dir=memory) as scratch:
        library = compile_shim(Path(scratch))
        environment = os.environ | ONE_THREAD | ({"LD_PRELOAD": str(library)} if library else {})
        command = [sys.executable, __file__, *sys.argv[1:], "--scratch", scratch, "--worker"]
        numbers = range(1 if options.sample is not None else options.workers)
        workers = [subprocess.Popen([*command, str(number)], env=environment) for number in numbers]
        codes = [worker.wait() for worker in workers]
    if options.sample is None:
        print(details(options.out))
    return max(codes)


def _work(options: argparse.Namespace) -> int:
    from harness.cases import Bench
    from harness.parts import Worker, all_parts
    from harness.patched import PatchedInjector
    from harness.shim import Injector

    injector = Injector() if "LD_PRELOAD" in os.environ else PatchedInjector()
    worker = Worker(Bench(options.scratch / f"worker-{options.worker}", injector))
    parts = [part for part in all_parts() if re.search(options.only, part.file)]
    if options.sample is not None:
        return _sample(worker, [part for part in parts if not part.slow], options)
    options.out.mkdir(parents=True, exist_ok=True)
    mine = parts[options.worker :: options.workers]
    others = [part for part in parts if part not in mine]
    until = time.monotonic() + 60 * options.minutes
    groups = [
        [part for part in some if part.needs_torch == needed]
        for some in (mine, others)
        for needed in (False, True)
    ]
    return max([_all(worker, group, options, until) for group in groups])


def _all(worker, parts, options, until) -> int:
    from harness.parts import is_done, read_counts

    folder, unsound = options.out, False
    while time.monotonic() < until and (left := [part for part in parts if not is_done(folder, part)]):
        for part in left:
            try:
                with _claimed(options.scratch / part.file) as claimed:
                    if not claimed:
                        time.sleep(0.1)
                        continue
                    worker.run(part, folder, until)
            except RuntimeError as error:
                print(error, file=sys.stderr)
                parts.remove(part)
                unsound = True
                continue
            print(part.file, read_counts(folder, part).get("outcomes"), flush=True)
    return int(unsound or any(read_counts(folder, part).get("bad") for part in parts))


@contextmanager
def _claimed(path: Path) -> Iterator[bool]:
    """Whether no other worker has the part."""
    with path.with_suffix(".lock").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield False
        else:
            yield True


def _sample(worker, parts, options) -> int:
    from harness.faults import Tally

    tally = Tally()
    for part in random.Random(options.seed).sample(parts, options.sample):
        for case in worker.cases(part, options.seed)[:1]:
            case(tally)
    print(json.dumps({"outcomes": tally.outcomes, "missed": tally.missed, "bad": tally.bad}, indent=1))
    return int(bool(tally.bad))


if __name__ == "__main__":
    sys.exit(main())
