"""A progress bar on stderr, silent where stderr is no terminal."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def progress(total: int | None, unit: str, description: str) -> Iterator[Callable[[int, int], None]]:
    """Show a bar with rate and time left; it vanishes at the end, whatever ends it.

    Args:
        total: how many there are, None where only the callback will tell.
        unit: what is counted, such as `scenes`.
        description: what is done, such as `extract`.

    Yields:
        A callback `(done, total)` for library functions that report progress.
    """
    from tqdm import tqdm

    silent = not sys.stderr.isatty()
    with tqdm(
        total=total, unit=f" {unit}", desc=description, file=sys.stderr, disable=silent, leave=False
    ) as bar:

        def advance(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        yield advance
