"""How the viewer begins: cameras over the level frame on the left, planes on the right, speed below."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ogmkit.footprints.sets import FULL_BODY
from ogmkit.homography.sources import SURFACE
from ogmkit.view.places import Camera, entity

FRONT = "CAM_FRONT"

_EYE_M, _LOOK_M = (-16, 0, 11), (20, 0, 0)
"""From where, and where to, the level frame is seen: from above the ego's back."""


@dataclass(frozen=True)
class SceneLayout:
    """What there is to lay out of a scene.

    Attributes:
        scene: its name.
        cameras: shown.
        footprints: names of the sets.
        homographies: names of the sources.
        predictions: names of the runs.
    """

    scene: str
    cameras: tuple[Camera, ...]
    footprints: tuple[str, ...]
    homographies: tuple[str, ...]
    predictions: tuple[str, ...]

    @property
    def main(self) -> Camera:
        """The camera whose level frame and plane are shown: the front one, else the first."""
        return next((one for one in self.cameras if one.channel == FRONT), self.cameras[0])


def blueprint(scenes: Sequence[SceneLayout]) -> Any:  # noqa: ANN401  # Rerun's
    """One tab a scene; what would cover other things is there, but hidden until it is asked for."""
    import rerun.blueprint as rrb  # noqa: PLC0415  # comes with the extra `view`

    tabs = [_scene(one) for one in scenes]
    root = tabs[0] if len(tabs) == 1 else rrb.Tabs(*tabs, active_tab=0)
    time = rrb.TimePanel(timeline="time", state="expanded")
    selection = rrb.SelectionPanel(state="collapsed")
    return rrb.Blueprint(root, time, selection, auto_views=False, collapse_panels=False)


def _scene(layout: SceneLayout) -> Any:  # noqa: ANN401  # Rerun's
    import rerun.blueprint as rrb  # noqa: PLC0415  # comes with the extra `view`

    columns = 1 if len(layout.cameras) == 1 else 2
    images = [_image(layout, camera) for camera in layout.cameras]
    predicted = [_plane(layout.main, name, (name,)) for name in layout.predictions]
    beside = [rrb.Tabs(*predicted, active_tab=0)] if predicted else []
    left = rrb.Vertical(rrb.Grid(*images, grid_columns=columns), _level(layout), row_shares=[1, 1])
    views = [left, _plane(layout.main, "truth", ()), *beside]
    speed = rrb.TimeSeriesView(origin=entity(layout.scene, "speed"), contents="$origin/**", name="speed")
    return rrb.Vertical(
        rrb.Horizontal(*views, column_shares=[2, *[1] * (len(views) - 1)]),
        speed,
        row_shares=[5, 1],
        name=layout.scene,
    )


def _image(layout: SceneLayout, camera: Camera) -> Any:  # noqa: ANN401  # Rerun's
    import rerun.blueprint as rrb  # noqa: PLC0415  # comes with the extra `view`

    shown = (
        SURFACE
        if SURFACE in layout.footprints
        else next((name for name in layout.footprints if name != FULL_BODY), "")
    )
    hidden = [camera.image("footprints", name) for name in layout.footprints if name != shown]
    hidden += [camera.image("homography", name) for name in layout.homographies]
    hidden += [camera.image("predictions", name) for name in layout.predictions]
    return rrb.Spatial2DView(
        origin=camera.image(), contents="$origin/**", name=camera.channel, overrides=_hidden(hidden)
    )


def _level(layout: SceneLayout) -> Any:  # noqa: ANN401  # Rerun's
    import rerun.blueprint as rrb  # noqa: PLC0415  # comes with the extra `view`

    main = layout.main
    contents = [f"+ {main.level()}/**", f"- {main.image()}/**"]
    for camera in layout.cameras:
        contents += [f"+ {camera.image()}", f"+ {camera.image('image')}"]
    eye = rrb.EyeControls3D(position=_EYE_M, look_target=_LOOK_M, eye_up=(0, 0, 1))
    name = f"{main.channel}, level frame"
    return rrb.Spatial3DView(origin=main.level(), contents=contents, name=name, eye_controls=eye)


def _plane(camera: Camera, name: str, predictions: tuple[str, ...]) -> Any:  # noqa: ANN401  # Rerun's
    """The plane with the truth, or with what a run predicted under the true paths."""
    import rerun.blueprint as rrb  # noqa: PLC0415  # comes with the extra `view`

    paths = [f"+ {camera.plane(one)}" for one in ("past", "future", "field_of_view")]
    if predictions:
        contents = [*paths, *(f"+ {camera.plane('predictions', one)}/**" for one in predictions)]
        hidden = []
    else:
        contents = [f"+ {camera.plane()}/**", f"- {camera.plane('predictions')}/**"]
        hidden = [camera.plane(one) for one in (*camera.rasters, "instances")]
    return rrb.Spatial2DView(
        origin=camera.plane(), contents=contents, name=f"plane, {name}", overrides=_hidden(hidden)
    )


def _hidden(places: Sequence[str]) -> Mapping[str, Any]:
    import rerun.blueprint as rrb  # noqa: PLC0415  # comes with the extra `view`

    return {place: rrb.EntityBehavior(visible=False) for place in places}
