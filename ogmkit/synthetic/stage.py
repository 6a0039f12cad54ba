"""One scene, ready to be recorded: ground, light, traffic, and the sensors on the ego."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ogmkit.geometry.se3 import pose_matrix
from ogmkit.synthetic.catalogue import Look
from ogmkit.synthetic.ground import HeightFunction
from ogmkit.synthetic.layout import Layout
from ogmkit.synthetic.motion import Actor
from ogmkit.synthetic.palette import Palette
from ogmkit.synthetic.plan import ScenePlan
from ogmkit.synthetic.relief import ego_pose, rolling_ground, yaw_quaternion
from ogmkit.synthetic.scenery import TREE, Scenery, Solids, concatenate
from ogmkit.synthetic.settings import SynthesisSettings
from ogmkit.synthetic.surroundings import draw_surroundings
from ogmkit.synthetic.traffic import Traffic, build_traffic
from ogmkit.typing import FloatArray, IntArray

ANNOTATION_RANGE_M = 80.0
_ACTOR_RANGE_M = 90.0
_BUILDING_RANGE_M = 130.0
_TREE_RANGE_M = 80.0
_GROUND_MARGIN_M = 120.0


@dataclass(frozen=True, eq=False)
class Box:
    """One actor's box at one moment, in the numbers that the tables hold.

    Attributes:
        actor: index into the scene's actors.
        look: what it is.
        translation: its middle, to the millimetre.
        rotation: quaternion [w, x, y, z].
        speed_m_s: how fast it moves.
        driven: whether somebody drives it.
    """

    actor: int
    look: Look
    translation: list[float]
    rotation: list[float]
    speed_m_s: float
    driven: bool


@dataclass(frozen=True, eq=False)
class Stage:
    """A scene's world over time; seconds count from `plan.start_us`.

    Attributes:
        plan: which scene.
        traffic: what moves and stands.
        height: the ground's, None where it is flat.
        scenery: ground and light.
        surroundings: houses and trees.
        tilt_rad: how far the ego's body leans.
    """

    plan: ScenePlan
    traffic: Traffic
    height: HeightFunction | None
    scenery: Scenery
    surroundings: Solids
    tilt_rad: float = 0.0

    def seconds(self, timestamp_us: int) -> float:
        """Scene time of a timestamp."""
        return (timestamp_us - self.plan.start_us) / 1e6

    def ego_pose(self, timestamp_us: int) -> tuple[list[float], list[float]]:
        """Translation and quaternion of the ego, rounded as the tables hold them."""
        translation, rotation = ego_pose(
            self.traffic.ego, self.seconds(timestamp_us), self.height, self.tilt_rad
        )
        return [round(value, 6) for value in translation], [round(value, 8) for value in rotation]

    def boxes(self, timestamp_us: int) -> list[Box]:
        """Boxes of all actors near enough to be seen."""
        time_s = self.seconds(timestamp_us)
        ego = np.array(self.traffic.ego.pose(time_s)[:2])
        found = []
        for number, actor in enumerate(self.traffic.actors):
            x, y, heading = actor.motion.pose(time_s)
            if np.hypot(x - ego[0], y - ego[1]) < _ACTOR_RANGE_M:
                found.append(self._box(number, actor, (x, y, heading), actor.motion.speed(time_s)))
        return found

    def solids(self, boxes: list[Box], timestamp_us: int) -> Solids:
        """What sensors meet: the boxes, exactly as the tables hold them, then houses and trees nearby."""
        ego = np.array(self.traffic.ego.pose(self.seconds(timestamp_us))[:2])
        places = np.array([box.translation for box in boxes]).reshape(-1, 3)
        rotations = np.array([box.rotation for box in boxes]).reshape(-1, 4)
        actors = Solids(
            global_from_box=pose_matrix(places, rotations),
            size_wlh=np.array([box.look.size_wlh for box in boxes]).reshape(-1, 3),
            category=tuple(box.look.category for box in boxes),
            colour_bgr=np.array([box.look.colour_bgr for box in boxes]).reshape(-1, 3),
            annotated=np.linalg.norm(places[:, :2] - ego, axis=1) < ANNOTATION_RANGE_M,
        )
        away_m = np.linalg.norm(self.surroundings.global_from_box[:, :2, 3] - ego, axis=1)
        near = np.flatnonzero(away_m < self._surroundings_range_m)
        return concatenate([actors, _selected(self.surroundings, near)])

    @cached_property
    def _surroundings_range_m(self) -> FloatArray:
        """(M,) how far away each building or tree still counts."""
        ranges = [_TREE_RANGE_M if name == TREE else _BUILDING_RANGE_M for name in self.surroundings.category]
        return np.array(ranges)

    def _box(self, number: int, actor: Actor, pose: tuple[float, float, float], speed_m_s: float) -> Box:
        x, y, heading = pose
        ground = 0.0 if self.height is None else float(self.height(np.array([x, y])))
        translation = [round(value, 3) for value in (x, y, ground + actor.look.size_wlh[2] / 2)]
        rotation = [round(value, 8) for value in yaw_quaternion(heading)]
        return Box(number, actor.look, translation, rotation, speed_m_s, actor.driver >= 0)


def build_stage(settings: SynthesisSettings, plan: ScenePlan, layout: Layout, duration_s: float) -> Stage:
    """Draw a scene; scenes of one location share its ground."""
    random = np.random.default_rng([settings.seed, 2, plan.index])
    traffic = build_traffic(
        random,
        layout.network,
        layout.car_parks,
        duration_s,
        incidents=settings.incidents,
        works_share=settings.works_share,
    )
    location_random = np.random.default_rng([settings.seed, 3, plan.log.location.index])
    height = rolling_ground(location_random, settings.relief_m) if settings.relief_m else None
    surroundings = draw_surroundings(location_random, layout, height)
    drive = np.array([traffic.ego.pose(time_s)[:2] for time_s in np.arange(0.0, duration_s + 1, 1.0)])
    low, high = drive.min(axis=0) - _GROUND_MARGIN_M, drive.max(axis=0) + _GROUND_MARGIN_M
    extent = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
    scenery = Scenery(layout.layers, height, Palette.from_seed(int(random.integers(2**31))), extent)
    return Stage(plan, traffic, height, scenery, surroundings, float(np.radians(settings.tilt_deg)))


def _selected(solids: Solids, indices: IntArray) -> Solids:
    return Solids(
        solids.global_from_box[indices],
        solids.size_wlh[indices],
        tuple(solids.category[index] for index in indices),
        solids.colour_bgr[indices],
        solids.annotated[indices],
    )
