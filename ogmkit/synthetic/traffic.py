"""A scene's traffic: everything that stands or moves on the ground over its duration, free of collisions."""

from dataclasses import dataclass, replace

import numpy as np

from ogmkit.synthetic.carparks import CarPark
from ogmkit.synthetic.catalogue import EGO_FRONT_M, EGO_WHEELBASE_M
from ogmkit.synthetic.curves import Path
from ogmkit.synthetic.drivers import Blockade, Driver
from ogmkit.synthetic.driving import STEP_S, Simulation
from ogmkit.synthetic.fleet import draw_drivers
from ogmkit.synthetic.motion import Actor, Driving
from ogmkit.synthetic.obstacles import Obstacle, draw_obstacles
from ogmkit.synthetic.overlap import overlaps
from ogmkit.synthetic.passing import plan_passing
from ogmkit.synthetic.roadside import draw_roadside
from ogmkit.synthetic.settings import SynthesisSettings
from ogmkit.synthetic.streets import Network
from ogmkit.synthetic.walkers import QUIET, draw_crossings, draw_walkers
from ogmkit.typing import FloatArray

_WARM_UP_S = 5.0
_AFTER_S = 1.0
_CHECK_S = 0.25
_QUIET = 0.92  # share of crossings that nobody uses where the ego has enough to do without
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
    random: np.random.Generator,
    network: Network,
    car_parks: tuple[CarPark, ...],
    duration_s: float,
    *,
    incidents: bool = False,
    works_share: float = SynthesisSettings.works_share,
) -> Traffic:
    """Draw and simulate a scene; whoever would collide is taken out and the scene simulated again.

    Args:
        random: source of choices.
        network: the streets.
        car_parks: beside them.
        duration_s: how long the scene lasts.
        incidents: whether vehicles stand in the ego's way, and somebody ahead of it brakes suddenly.
        works_share: share of roadsides with road works.
    """
    times_s = np.arange(-_WARM_UP_S, duration_s + _AFTER_S + STEP_S, STEP_S)
    still = draw_roadside(random, network, car_parks, works_share) + draw_walkers(random, network)
    crossing, blockades = draw_crossings(random, network, duration_s, _QUIET if incidents else QUIET)
    drivers = draw_drivers(random, network, float(times_s[-1] - times_s[0]), incidents=incidents)
    obstacles = []
    if incidents:
        obstacles = draw_obstacles(random, network, drivers[0].route, drivers[0].start_m)
        drivers = _passing(drivers, obstacles)
    standing = [obstacle.actor for obstacle in obstacles]
    while True:
        driven, ego = _drive(network, drivers, blockades, times_s)
        culprits = _colliding_drivers([*driven, *standing], duration_s)
        if not culprits:
            break
        drivers = [driver for number, driver in enumerate(drivers) if number not in culprits]
    kept = _without_collisions(driven, [*standing, *crossing, *still], duration_s)
    return Traffic(ego, tuple(kept[1:]))  # the first is the ego's own body


def _passing(drivers: list[Driver], obstacles: list[Obstacle]) -> list[Driver]:
    """Those who find a way past all obstacles on their routes; the ego always does, they are drawn for it."""
    able = []
    for driver in drivers:
        line = driver.route.path.offset(driver.left_m)
        width_m = max(look.size_wlh[0] for look, _ in driver.parts)
        passing = plan_passing(line, obstacles, width_m, driver.cruise_m_s)
        if passing is not None:
            able.append(replace(driver, passing=passing))
    return able


def _drive(
    network: Network, drivers: list[Driver], blockades: list[Blockade], times_s: FloatArray
) -> tuple[list[Actor], Driving]:
    """The parts of all vehicles, the ego's body first, and the ego's rear axle."""
    fronts_m, speeds_m_s = Simulation(network, drivers, blockades).run(times_s)
    actors = []
    for number, driver in enumerate(drivers):
        way = _way(driver, times_s, fronts_m[number], speeds_m_s[number])
        for look, middle_m in driver.parts:
            half_m = _WHEELBASE_SHARE / 2 * look.size_wlh[1]
            actors.append(Actor(look, Driving(*way, middle_m + half_m, 2 * half_m, half_m), number))
    ego_way = _way(drivers[0], times_s, fronts_m[0], speeds_m_s[0])
    return actors, Driving(*ego_way, EGO_FRONT_M, EGO_WHEELBASE_M, 0.0)


def _way(
    driver: Driver, times_s: FloatArray, fronts_m: FloatArray, speeds_m_s: FloatArray
) -> tuple[Path, FloatArray, FloatArray, FloatArray]:
    """The path that a driver's vehicle takes, times, and at them its front's distance on it and speed."""
    usual = driver.route.path
    if driver.passing is None:
        path = usual.offset(driver.left_m) if driver.left_m else usual
        stretch = path.length / usual.length
        return path, times_s, fronts_m * stretch, speeds_m_s * stretch
    path = usual.offset(driver.left_m + driver.passing.left_m)
    stretches = np.interp(fronts_m, usual.distances, np.gradient(path.distances, usual.distances))
    return path, times_s, np.interp(fronts_m, usual.distances, path.distances), speeds_m_s * stretches


def _poses(actors: list[Actor], time_s: float) -> tuple[FloatArray, FloatArray]:
    """(N, 3) poses and (N, 2) widths and lengths."""
    poses = np.array([actor.motion.pose(time_s) for actor in actors]).reshape(-1, 3)
    sizes = np.array([actor.look.size_wlh[:2] for actor in actors]).reshape(-1, 2)
    return poses, sizes


def _colliding_drivers(actors: list[Actor], duration_s: float) -> set[int]:
    """The later ones of drivers whose vehicles ever touch each other or what stands; never the ego."""
    owners = np.array([actor.driver for actor in actors])
    culprits: set[int] = set()
    for time_s in np.arange(0.0, duration_s + _CHECK_S, _CHECK_S):
        for one, other in np.argwhere(overlaps(*_poses(actors, float(time_s)))):
            if owners[one] != owners[other]:
                culprits.add(int(max(owners[one], owners[other])))
    return culprits - {0}


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
