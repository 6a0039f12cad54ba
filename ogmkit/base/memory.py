"""What a process keeps of the memory that it frees."""

import ctypes
import functools
from contextlib import suppress

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
"""Of glibc's mallopt(3)."""
_KEPT_BYTES, _LARGEST_BYTES = 1 << 26, 1 << 25


@functools.cache
def keep_freed_memory() -> None:
    """Keep up to 64 MiB for the next frame, whose rasters are as large as this one's.

    By default glibc returns this memory to the system after each frame, and faulting the pages in again costs
    a tenth of a frame's time. Other C libraries are left alone.
    """
    with suppress(OSError, AttributeError):
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(_MMAP_THRESHOLD, _LARGEST_BYTES)
        mallopt(_TRIM_THRESHOLD, _KEPT_BYTES)
