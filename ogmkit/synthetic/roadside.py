"""What stands beside the lanes: parked vehicles, a road works site, things on the walkways."""

import numpy as np

from ogmkit.synthetic.carparks import CarPark
from ogmkit.synthetic.catalogue import draw_look
from ogmkit.synthetic.curves import direction
from ogmkit.synthetic.motion import Actor, Standing
from ogmkit.synthetic.streets import PARKING_M, Network, Road
from ogmkit.typing import FloatArray

_OCCUPIED = 0.62
_SPACING_M = 1.1
_PARKED = {
    "vehicle.car": 0.78,
    "vehicle.truck": 0.06,
    "vehicle.motorcycle": 0.05,
    "vehicle.trailer": 0.03,
    "vehicle.bus.rigid": 0.03,
    "vehicle.emergency.police": 0.03,
    "vehicle.emergency.ambulance": 0.02,
}
_ON_WALKWAY = {
    "static_object.bicycle_rack": 0.2,
    "vehicle.bicycle": 0.35,
    "movable_object.pushable_pullable": 0.3,
    "movable_object.debris": 0.15,
}
_DRIVEWAY_CLEARANCE_M = 9.0


def draw_roadside(
    random: np.random.Generator,
    network: Network,
    car_parks: tuple[CarPark, ...],
    works_share: float,
) -> list[Actor]:
    """Everything that stands still in a scene."""
    driveways = np.array([np.mean(park.driveway.exterior.coords[:4], axis=0) for park in car_parks])
    driveways = driveways.reshape(-1, 2)
    actors: list[Actor] = []
    for road in network.roads:
        for side in (1, -1):
            bays = road.bays[0] if side > 0 else road.bays[1]
            works = int(random.integers(len(bays))) if bays and random.uniform() < works_share else -1
            for number, bay in enumerate(bays):
                fill = _road_works if number == works else _parked_row
                actors += fill(random, network, road, side, bay)
            actors += _walkway_things(random, road, side)
    actors = [actor for actor in actors if _is_clear_of(driveways, actor)]
    return actors + [actor for park in car_parks for actor in _car_park(random, park)]


def _parked_row(
    random: np.random.Generator, network: Network, road: Road, side: int, bay: tuple[float, float]
) -> list[Actor]:
    """Vehicles along the kerb, some places empty."""
    actors: list[Actor] = []
    place_m = bay[0]
    while True:
        look = draw_look(random, _choose(random, _PARKED))
        length_m = look.size_wlh[1]
        if place_m + length_m > bay[1]:
            return actors
        if random.uniform() < _OCCUPIED and look.size_wlh[0] < PARKING_M:
            gap_m = PARKING_M / 2 + float(random.uniform(-0.08, 0.08))
            pose = beside(road, side, place_m + length_m / 2, -gap_m)
            flip = 0.0 if side == network.traffic_side else np.pi
            turn = flip + float(random.normal(0, 0.012))
            actors.append(Actor(look, Standing(pose[0], pose[1], pose[2] + turn)))
        place_m += length_m + _SPACING_M


def _road_works(
    random: np.random.Generator, network: Network, road: Road, side: int, bay: tuple[float, float]
) -> list[Actor]:
    """A construction vehicle in a parking bay, behind barriers and cones, and workers."""
    start_m = bay[0] + 1.0
    end_m = min(bay[1] - 1.0, start_m + 24.0)
    things: list[tuple[str, float, float, float]] = [
        ("vehicle.construction", start_m + 6.5, -PARKING_M / 2 - 0.05, 0.0),
        ("movable_object.barrier", start_m + 0.5, -PARKING_M / 2, 0.0),
        ("movable_object.barrier", end_m - 0.5, -PARKING_M / 2, 0.0),
        ("human.pedestrian.construction_worker", start_m + 12.0, -PARKING_M / 2, 1.0),
    ]
    if end_m - start_m > 18:
        things.append(("human.pedestrian.construction_worker", start_m + 15.0, -PARKING_M / 2 - 0.4, -2.0))
    cones = np.arange(start_m + 2.0, end_m - 1.5, 2.6)
    things += [("movable_object.trafficcone", float(x), -PARKING_M + 0.05, 0.0) for x in cones]
    actors = []
    for category, along_m, left_of_kerb_m, turn in things:
        x, y, heading = beside(road, side, along_m, left_of_kerb_m)
        actors.append(Actor(draw_look(random, category), Standing(x, y, heading + turn)))
    return actors


def _walkway_things(random: np.random.Generator, road: Road, side: int) -> list[Actor]:
    """Racks, bicycles, bins and rubbish at the walkway's outer edge."""
    actors = []
    for along_m in np.arange(8.0, road.centre.length - 8.0, 16.0) + random.uniform(-4, 4):
        if random.uniform() < 0.4:
            look = draw_look(random, _choose(random, _ON_WALKWAY))
            x, y, heading = beside(road, side, float(along_m), road.section.walkway_m - 0.6)
            if look.category == "static_object.bicycle_rack":
                x, y, heading = beside(road, side, float(along_m), road.section.walkway_m + 0.6)
                heading += np.pi / 2
            actors.append(Actor(look, Standing(x, y, heading)))
    return actors


def _car_park(random: np.random.Generator, park: CarPark) -> list[Actor]:
    actors = []
    for x, y, heading in park.stalls:
        if random.uniform() < _OCCUPIED:
            look = draw_look(random, "vehicle.car" if random.uniform() < 0.93 else "vehicle.motorcycle")
            shift = float(random.uniform(-0.15, 0.15)) * direction(heading)
            backwards = np.pi if random.uniform() < 0.3 else 0.0
            actors.append(
                Actor(look, Standing(float(x + shift[0]), float(y + shift[1]), float(heading) + backwards))
            )
    return actors


def beside(road: Road, side: int, along_m: float, from_kerb_m: float) -> tuple[float, float, float]:
    """Pose beside a road: metres along its middle line, metres outward from the kerb."""
    kerb_m = float(np.interp(along_m, road.centre.distances, road.left_m if side > 0 else road.right_m))
    heading = float(road.centre.heading(along_m))
    x, y = road.centre.at(along_m) + side * (kerb_m + from_kerb_m) * direction(heading + np.pi / 2)
    return float(x), float(y), heading


def _is_clear_of(driveways: FloatArray, actor: Actor) -> bool:
    position = np.array(actor.motion.pose(0.0)[:2])
    return bool(np.all(np.linalg.norm(driveways - position, axis=1) > _DRIVEWAY_CLEARANCE_M))


def _choose(random: np.random.Generator, shares: dict[str, float]) -> str:
    return str(random.choice(list(shares), p=np.array(list(shares.values())) / sum(shares.values())))
