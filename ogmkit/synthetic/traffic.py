"""A scene's traffic: everything that stands or moves on the ground over its duration, free of collisions."""

from dataclasses import dataclass

import numpy as np

from ogmkit.synthetic.carparks import CarPark
from ogmkit.synthetic.catalogue import EGO_FRONT_M, EGO_WHEELBASE_M
from ogmkit.synthetic.driving import STEP_S, Blockade, Driver, Simulation
from ogmkit.synthetic.fleet import draw_drivers
from ogmkit.synthetic.motion import Actor, Driving
from ogmkit.synthetic.overlap import overlaps
from ogmkit.synthetic.roadside import draw_roadside
from ogmkit.synthetic.streets import Network
from ogmkit.synthetic.walkers import draw_crossings, draw_walkers
from ogmkit.typing import FloatArray

_WARM_UP_S = 5.0
_AFTER_S = 1.0
_CHECK_S = 0.25
_WHEELBASE_SHARE = 0.6  # of a vehicle's length


@dataclass(frozen=True, eq=False)
class Traffic:
    """What moves and stands in a scene.

    Attributes:
        ego: the ego's rear axle.
        actors: everybody and everything else.
    """

    ego: Driving
    actors: tuple[Actor, ...]


def build_traffic(
    random: np.random.Generator, network: Network, car_parks: tuple[CarPark, ...], duration_s: float
) -> Traffic:
    """Draw and simulate a scene; whoever would collide is taken out and the scene simulated again."""
    times_s = np.arange(-_WARM_UP_S, duration_s + _AFTER_S + STEP_S, STEP_S)
    still = draw_roadside(random, network, car_parks) + draw_walkers(random, network)
    crossing, blockades = draw_crossings(random, network, duration_s)
    drivers = draw_drivers(random, network, float(times_s[-1] - times_s[0]))
    while True:
        driven, ego = _drive(network, drivers, blockades, times_s)
        culprits = _colliding_drivers(driven, duration_s)
        if not culprits:
            break
        drivers = [driver for number, driver in enumerate(drivers) if number not in culprits]
    kept = _without_collisions(driven, [*crossing, *still], duration_s)
    return Traffic(ego, tuple(kept[1:]))  # the first is the ego's own body


def _drive(
    network: Network, drivers: list[Driver], blockades: list[Blockade], times_s: FloatArray
) -> tuple[list[Actor], Driving]:
    """The parts of all vehicles, the ego's body first, and the ego's rear axle."""
    fronts_m, speeds_m_s = Simulation(network, drivers, blockades).run(times_s)
    actors = []
    for number, driver in enumerate(drivers):
        path = driver.route.path.offset(driver.left_m) if driver.left_m else driver.route.path
        stretch = path.length / driver.route.path.length
        way = (path, times_s, fronts_m[number] * stretch, speeds_m_s[number] * stretch)
        for look, middle_m in driver.parts:
            half_m = _WHEELBASE_SHARE / 2 * look.size_wlh[1]
            actors.append(Actor(look, Driving(*way, middle_m + half_m, 2 * half_m, half_m), number))
    ego_way = (drivers[0].route.path, times_s, fronts_m[0], speeds_m_s[0])
    return actors, Driving(*ego_way, EGO_FRONT_M, EGO_WHEELBASE_M, 0.0)


def _poses(actors: list[Actor], time_s: float) -> tuple[FloatArray, FloatArray]:
    """(N, 3) poses and (N, 2) widths and lengths."""
    poses = np.array([actor.motion.pose(time_s) for actor in actors]).reshape(-1, 3)
    sizes = np.array([actor.look.size_wlh[:2] for actor in actors]).reshape(-1, 2)
    return poses, sizes


def _colliding_drivers(actors: list[Actor], duration_s: float) -> set[int]:
    """The later ones of drivers whose vehicles ever touch; never the ego."""
    owners = np.array([actor.driver for actor in actors])
    culprits: set[int] = set()
    for time_s in np.arange(0.0, duration_s + _CHECK_S, _CHECK_S):
        for one, other in np.argwhere(overlaps(*_poses(actors, float(time_s)))):
            if owners[one] != owners[other]:
                culprits.add(int(max(owners[one], owners[other])))
    return culprits


def _without_collisions(driven: list[Actor], others: list[Actor], duration_s: float) -> list[Actor]:
    """All who are driven, and of the others those who never touch them or somebody named before them."""
    actors = driven + others
    alive = np.ones(len(actors), dtype=np.bool_)
    for time_s in np.arange(0.0, duration_s + _CHECK_S, _CHECK_S):
        touching = overlaps(*_poses(actors, float(time_s)))
        for number in range(len(driven), len(actors)):
            if np.any(touching[number, :number] & alive[:number]):
                alive[number] = False
    return [actor for actor, keep in zip(actors, alive, strict=True) if keep]
