"""People on the walkways and at the crossings."""

import numpy as np

from ogmkit.synthetic.catalogue import draw_look
from ogmkit.synthetic.curves import Path
from ogmkit.synthetic.drivers import Blockade
from ogmkit.synthetic.motion import Actor, Crossing, Standing, Strolling
from ogmkit.synthetic.streets import CROSSING_M, Network, Road

_KINDS = {
    "human.pedestrian.adult": 0.72,
    "human.pedestrian.child": 0.08,
    "human.pedestrian.police_officer": 0.04,
    "human.pedestrian.wheelchair": 0.03,
    "human.pedestrian.stroller": 0.05,
    "human.pedestrian.personal_mobility": 0.05,
    "animal": 0.03,
}
_PER_M = 1 / 28
_STANDING = 0.2
QUIET = 0.65
"""Share of crossings that nobody uses, usually."""
_WARNING_S = 8.0  # a crossing is closed so long before somebody steps on it
_CROSSING_MIDDLE_M = 0.7 + CROSSING_M / 2


def draw_walkers(random: np.random.Generator, network: Network) -> list[Actor]:
    """People who keep to the walkways."""
    actors = []
    for road in network.roads:
        for side, kerb_m in ((1, road.left_m), (-1, road.right_m)):
            for _ in range(random.poisson(road.centre.length * _PER_M)):
                # The walkway's outer metre is for things that stand there.
                outward = kerb_m + float(random.uniform(0.5, road.section.walkway_m - 1.3))
                path = road.centre.offset(side * outward).part(2.0, road.centre.length - 2.0)
                start_m = float(random.uniform(0, 2 * path.length))
                look = draw_look(random, str(random.choice(list(_KINDS), p=list(_KINDS.values()))))
                stroll = Strolling(path, start_m, float(random.uniform(0.7, 1.6)))
                rests = random.uniform() < _STANDING
                actors.append(Actor(look, Standing(*stroll.pose(0.0)) if rests else stroll))
    return actors


def draw_crossings(
    random: np.random.Generator, network: Network, duration_s: float, quiet: float
) -> tuple[list[Actor], list[Blockade]]:
    """People who cross, and when the crossings are closed to vehicles for them.

    Args:
        random: source of choices.
        network: the streets.
        duration_s: how long the scene lasts.
        quiet: share of crossings that nobody uses.
    """
    actors, blockades = [], []
    for index, road in enumerate(network.roads):
        for at_end in (False, True):
            if random.uniform() < quiet:
                continue
            begin_s = float(random.uniform(0.0, duration_s))
            crossing = Crossing(_way_across(random, road, at_end), begin_s, float(random.uniform(1.1, 1.6)))
            actors.append(Actor(draw_look(random, "human.pedestrian.adult"), crossing))
            blockades.append(Blockade(index, at_end, begin_s - _WARNING_S, crossing.end_s))
    return actors, blockades


def _way_across(random: np.random.Generator, road: Road, at_end: bool) -> Path:
    along_m = road.centre.length - _CROSSING_MIDDLE_M if at_end else _CROSSING_MIDDLE_M
    along_m += float(random.uniform(-0.9, 0.9))
    reach_m = road.section.half_m + 1.2
    ends = [
        road.centre.part(along_m, along_m + 0.1).offset(side * reach_m).points[0]
        for side in random.permutation([-1, 1])
    ]
    return Path(np.linspace(ends[0], ends[1], 40))
