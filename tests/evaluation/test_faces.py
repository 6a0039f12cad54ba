import numpy as np

from ogmkit.evaluation.faces import vehicle_faces
from ogmkit.raster.fill import fill_polygons
from ogmkit.shards.reader import Shard


def test_faces_are_those_of_the_raster(eval_shards):
    vehicles = 0
    for path in eval_shards.glob("*.h5"):
        with Shard(path) as shard:
            for index in range(shard.frames("CAM_FRONT")):
                faces = vehicle_faces(shard, "CAM_FRONT", index)
                vehicles += len(faces)
                drawn = fill_polygons(shard.grid.cells(faces), shard.grid.shape)
                np.testing.assert_array_equal(drawn, shard.dataset("CAM_FRONT", "vehicles")[index])
    assert vehicles
