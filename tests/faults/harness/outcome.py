"""What came of a disturbed command, in one word."""

import re
from collections.abc import Iterable, Mapping

from harness.forked import Ended

OK, NAMED = "ok", "named error"
TRACEBACK, HANG, CRASH, BIG = "traceback", "hang", "crash", "over 2 GB"
WRONG, LOST, UNFINISHED, UNNAMED = "silently wrong", "lost", "not finished again", "unnamed error"
OUTCOMES = (OK, NAMED, TRACEBACK, HANG, CRASH, BIG, WRONG, LOST, UNFINISHED, UNNAMED)
BAD = frozenset(OUTCOMES) - {OK, NAMED}

_MOST_BYTES = 2 << 30
_CODES = (0, 1, 2)
_PROGRESS = re.compile(r"(?!ogmkit: )[a-z\d][\w/ -]*: ")
"""How a line of progress begins, as in tests/cli/conftest.py."""
_DECODER = re.compile(r"Corrupt JPEG data: |Premature end of JPEG file|Invalid SOS parameters ")
"""Lines that OpenCV's decoder writes itself, beside the command's own."""
_OURS = re.compile(r"ogmkit: |Error: |Usage: |Try '")


def of_end(ended: Ended, names: Iterable[str]) -> str:
    """By how a process ended, whatever it wrote to files.

    Args:
        ended: the process.
        names: of files and records; a good message has one of them.
    """
    if ended.timed_out:
        return HANG
    if ended.peak_bytes > _MOST_BYTES:
        return BIG
    if ended.signal:
        return CRASH
    if "Traceback (most recent" in ended.stderr or ended.code not in _CODES:
        return TRACEBACK
    if ended.code == 0:
        return OK
    return NAMED if _named(ended, names) else UNNAMED


def of_files(before: Mapping[str, str], found: Mapping[str, str], sound: Mapping[str, str]) -> str:
    """By what became of files that were there: each is as it was, or as it should become.

    Args:
        before: path → checksum, of what was whole before.
        found: after the disturbance.
        sound: after an undisturbed run.
    """
    for path, digest in before.items():
        removed = path not in sound and path not in found
        if found.get(path) not in {digest, sound.get(path)} - {None} and not removed:
            return LOST
    return OK


def of_result(
    ended: Ended, found: Mapping[str, str], sound_end: Ended, sound: Mapping[str, str], *, speaks: bool
) -> str:
    """By the result of a command that says it succeeded."""
    same = found == sound and (not speaks or ended.stdout == sound_end.stdout)
    return OK if same else WRONG


def names_of(*contents: Mapping[str, str]) -> set[str]:
    """Names of files, folders and scenes, one of which a good message has."""
    parts = {part for files in contents for path in files for part in path.split("/")}
    return parts | {"scene-0001", "scene-0002", "case"}  # the last is where commands run


def differing(found: Mapping[str, str], sound: Mapping[str, str]) -> list[str]:
    """Paths of files that are not as after an undisturbed run."""
    return sorted(path for path in found.keys() | sound.keys() if found.get(path) != sound.get(path))


def complaint(ended: Ended) -> str:
    """What a command wrote to stderr, but for progress."""
    lines = ended.stderr.replace("\r", "\n").splitlines()
    own = (line for line in lines if line and not _DECODER.match(line))
    return "\n".join(line for line in own if not _PROGRESS.match(line))


def _named(ended: Ended, names: Iterable[str]) -> bool:
    lines = complaint(ended).splitlines()
    if any(not _OURS.match(line) for line in lines):
        return False
    said = lines or ended.stdout.splitlines()
    wanted = re.compile("|".join(rf"(?<!\w){re.escape(name)}(?!\w)" for name in names) or "$^")
    return (
        any(wanted.search(line) for line in said)
        if not lines
        else all(wanted.search(line) for line in lines if line.startswith("ogmkit: "))
    )
