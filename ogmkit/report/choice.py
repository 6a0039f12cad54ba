"""Which frames of a scene are pictured, and how many the page has room for."""

from collections.abc import Mapping, Sequence

from ogmkit.pictures.views import evenly
from ogmkit.report.thumbnails import FRAME_CHARACTERS

MOST_BYTES = 50_000_000
"""Of a page of a thousand scenes."""
_FOR_PICTURES = 44_000_000

Place = tuple[str, int]
"""Camera, and the frame's place among the camera's."""
Lacks = Mapping[Place, Sequence[str]]
"""What frames lack, and why, in words; frames that lack nothing may be absent."""


def frames_a_scene(scenes: int, asked: int, taken: int = 0) -> int:
    """How many frames of a scene can be pictured.

    Args:
        scenes: of the page.
        asked: the most that are wanted.
        taken: characters that other pictures take.
    """
    room = (_FOR_PICTURES - taken) // (FRAME_CHARACTERS * max(scenes, 1))
    return min(asked, max(room, 1))


def chosen_frames(counts: Mapping[str, int], lacks: Lacks, most: int) -> tuple[Place, ...]:
    """At most so many frames of a scene, in order: one for each thing that is lacking, others spread evenly.

    Args:
        counts: camera → its frames.
        lacks: why frames are invalid.
        most: how many.
    """
    places = [(camera, index) for camera, count in counts.items() for index in range(count)]
    examples = _one_each(lacks)[: most // 2]
    others = [place for place in places if place not in examples]
    spread = (others[one] for one in evenly(most - len(examples), len(others)))
    return tuple(sorted({*examples, *spread}))


def _one_each(lacks: Lacks) -> list[Place]:
    """The first frame of each thing that is lacking."""
    found: dict[str, Place] = {}
    for place in sorted(lacks):
        for reason in lacks[place]:
            found.setdefault(reason, place)
    return list(dict.fromkeys(found.values()))
