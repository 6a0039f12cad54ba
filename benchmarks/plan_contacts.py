"""Which collisions the definitions of planning scores find: against known contacts in synthetic incidents."""

import numpy as np
import shapely

from ogmkit.grid import GridSpec
from ogmkit.metrics.open_loop.catalogue import DEFINITIONS, EXACT
from ogmkit.metrics.open_loop.contact import contacts
from ogmkit.metrics.open_loop.scores import Surrounding, point_values
from ogmkit.synthetic.catalogue import EGO_SIZE_WLH
from ogmkit.synthetic.fleet import draw_drivers
from ogmkit.synthetic.layout import LOCATIONS, build_layout
from ogmkit.synthetic.obstacles import draw_obstacles
from ogmkit.synthetic.passing import plan_passing

SEEDS = range(12)
START_M, EVERY_M, LEFT_M = 5.0, 4.0, 40.0
"""Plans begin every few metres of the way, from a first place to some metres before its end."""
GIVEN = "exact, headings given"
STEPS = 0.5 * np.arange(7)


def rectangle(x, y, heading, length, width, ahead=0.0):
    """(4, 2) corners."""
    turn = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    half = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]) / 2
    return np.array([x, y]) + (half * (length, width) + (ahead, 0.0)) @ turn


def pose(path, at_m):
    """x, y and heading of a way."""
    here, ahead = np.array(
        [np.interp([at_m - 0.25, at_m + 0.25], path.distances, path.points[:, axis]) for axis in (0, 1)]
    ).T
    return np.array([*(here + ahead) / 2, np.arctan2(*(ahead - here)[::-1])])


def cases(seed):
    """Of plans along the lane and past what stands in it: poses, driven ones, corners of obstacles."""
    random, network = np.random.default_rng(seed), build_layout(3, LOCATIONS[seed % 2]).network
    ego = draw_drivers(random, network, 35.0, incidents=True)[0]
    obstacles = draw_obstacles(random, network, ego.route, ego.start_m)
    passing = plan_passing(ego.route.path, obstacles, EGO_SIZE_WLH[0], ego.cruise_m_s)
    others = np.stack([rectangle(*item.place.pose(0.0), *item.look.size_wlh[1::-1]) for item in obstacles])
    lane = ego.route.path
    driven = lane.offset(passing.left_m)
    for path in (lane, driven):
        for start_m in np.arange(START_M, path.distances[-1] - LEFT_M, EVERY_M):
            at_m = start_m + ego.cruise_m_s * STEPS
            planned, true = (np.array([pose(way, each) for each in at_m]) for way in (path, driven))
            yield planned, true, others


def in_contact(poses, others):
    """(6,) whether the ego's box touches any other, on the way's own headings."""
    box, found = EXACT.ego, []
    tree = shapely.STRtree(shapely.polygons(others))
    for x, y, heading in poses[1:]:
        own = shapely.Polygon(rectangle(x, y, heading, box.length_m, box.width_m, box.centre_ahead_m))
        found.append(own.intersects(tree.geometries[tree.nearest(own)]))
    return np.array(found)


def local(poses, others):
    """(6, 2) plan and (M, 4, 2) corners in the level frame of the first pose."""
    cos, sin = np.cos(poses[0, 2]), np.sin(poses[0, 2])
    turn = np.array([[cos, -sin], [sin, cos]])
    return (poses[1:, :2] - poses[0, :2]) @ turn, (others - poses[0, :2]) @ turn


def main():
    """Print recall and precision of each definition, point by point."""
    touching, found = [], {name: [] for name in (*DEFINITIONS, GIVEN)}
    for seed in SEEDS:
        for planned, true, others in cases(seed):
            plan, faces = local(planned, others)
            truth = local(np.concatenate([planned[:1], true[1:]]), others)[0]
            around = Surrounding(truth, [faces] * 6, None, GridSpec())
            touching.append(in_contact(planned, others))
            for name, one in DEFINITIONS.items():
                found[name].append(point_values(one, plan[None], around)["collision"][0])
            known = planned[None, 1:, 2] - planned[0, 2]
            found[GIVEN].append(contacts(plan[None], around.faces, EXACT.ego, known)[0])
    true = np.array(touching)
    print(f"{len(true)} plans, {true.sum()} of {true.size} points in contact\n")
    print("| definition | found | recall | precision |\n| --- | ---: | ---: | ---: |")
    for name, values in found.items():
        hit = np.array(values) == 1
        both = np.count_nonzero(hit & true)
        print(f"| `{name}` | {hit.sum()} | {both / true.sum():.4f} | {both / hit.sum():.4f} |")


if __name__ == "__main__":
    main()
