"""Which frames are pictured, and whether a thousand scenes fit."""

from hypothesis import given
from hypothesis import strategies as st

from ogmkit.report.choice import MOST_BYTES, chosen_frames, frames_a_scene
from ogmkit.report.thumbnails import FRAME_CHARACTERS


def test_a_thousand_scenes_fit_with_room_for_all_else():
    frames = frames_a_scene(1000, 12)
    assert frames == 3
    assert 1000 * frames * FRAME_CHARACTERS < MOST_BYTES - 5_000_000


def test_small_folders_get_what_is_asked_for():
    assert frames_a_scene(10, 12) == 12
    assert frames_a_scene(10, 0) == 0
    assert frames_a_scene(0, 12) == 12


def test_other_pictures_take_their_room():
    assert frames_a_scene(1000, 12, taken=20_000_000) == 1


@given(
    st.dictionaries(st.sampled_from(["CAM_BACK", "CAM_FRONT"]), st.integers(0, 30)),
    st.integers(0, 40),
    st.data(),
)
def test_at_most_so_many_in_order_and_one_of_each_kind(counts, most, data):
    places = [(camera, index) for camera, count in counts.items() for index in range(count)]
    lacking = data.draw(st.lists(st.sampled_from(places), unique=True)) if places else []
    lacks = {place: [f"reason {index % 3}"] for index, place in enumerate(lacking)}
    found = chosen_frames(counts, lacks, most)
    assert list(found) == sorted(set(found))
    assert len(found) == min(most, len(places))
    assert set(found) <= set(places)
    kinds = {reason for reasons in lacks.values() for reason in reasons}
    shown = {reason for place in found for reason in lacks.get(place, ())}
    assert len(shown) >= min(len(kinds), most // 2)


def test_the_rest_is_spread_evenly():
    assert chosen_frames({"CAM_FRONT": 40}, {}, 4) == tuple(("CAM_FRONT", index) for index in (5, 15, 25, 35))
