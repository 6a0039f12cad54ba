"""Output that a terminal's character set lacks becomes ASCII instead of an error or mojibake."""

import codecs
import io
import locale
import os
import sys
import unicodedata
from typing import TextIO

_FALLBACKS = {
    "→": "->",
    "↔": "<->",
    "×": "x",
    "·": "-",
    "…": "...",
    "–": "-",
    "—": "-",
    "−": "-",
    "±": "+/-",
    "≤": "<=",
    "≥": ">=",
    "α": "alpha",
    "σ": "sigma",
    "‘": "'",
    "’": "'",
    "“": '"',
    "”": '"',
}
_ERRORS = "ogmkit"
_ASCII = "ogmkit-ascii"


def adapt(stream: TextIO) -> None:
    """Have a stream write what its character set lacks in ASCII, such as `->` for an arrow.

    A letter loses its accent; of anything else the code point is written. A stream that encodes nothing, such
    as a StringIO, stays as it is.
    """
    if not isinstance(stream, io.TextIOWrapper):
        return
    if codecs.lookup(stream.encoding).name == "ascii" or _is_posix_terminal(stream):
        stream.reconfigure(encoding=_ASCII, errors=_ERRORS)
    else:
        stream.reconfigure(errors=_ERRORS)


def _is_posix_terminal(stream: TextIO) -> bool:
    """Whether Python writes UTF-8 although the user's locale is C: then nothing says it can be shown."""
    told = "PYTHONIOENCODING" in os.environ or "PYTHONUTF8" in os.environ
    standard = stream in (sys.__stdout__, sys.__stderr__)
    return standard and not told and locale.setlocale(locale.LC_CTYPE) in ("C", "POSIX")


def _replaced(error: UnicodeError) -> tuple[str, int]:
    """What stands for characters that can't be encoded, as a handler of codecs gives it."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(map(_fallback, error.object[error.start : error.end])), error.end


def _fallback(character: str) -> str:
    plain = unicodedata.normalize("NFKD", character).encode("ascii", "ignore").decode()
    return _FALLBACKS.get(character) or plain or ascii(character)[1:-1]


def _find(name: str) -> codecs.CodecInfo | None:
    """ASCII under another name: Click takes a stream that calls itself ASCII for UTF-8."""
    if name.replace("_", "-") != _ASCII:
        return None
    found = codecs.lookup("ascii")
    return codecs.CodecInfo(
        found.encode,
        found.decode,
        incrementalencoder=found.incrementalencoder,
        incrementaldecoder=found.incrementaldecoder,
        name=_ASCII,
    )


codecs.register(_find)
codecs.register_error(_ERRORS, _replaced)
