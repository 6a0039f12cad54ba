"""What measured commands can't be faster than: `python benchmarks/scale_floor.py KIND …` prints seconds.

bare DATAROOT OUT CACHE FIRST LAST   the warp, fill and h5py calls of these scenes' frames
read SHARDS FIRST LAST               sha256 of the files, and gunzip of their chunks
tables DATAROOT                      reading the tables' files
"""

import hashlib
import json
import sys
import time
import zlib
from pathlib import Path

import h5py
from bare_calls import prepare, write_bare

from ogmkit.nuscenes.dataset import Dataset
from ogmkit.nuscenes.maps import MaskStore
from ogmkit.target_settings import TargetSettings

CAMERA = "CAM_FRONT"
PART = 1 << 20


def bare(dataroot, out, cache, first, last):
    """Seconds of the bare calls, scene by scene; what they are called with is worked out between them."""
    masks, grid, spent = MaskStore(Path(cache)), TargetSettings().grid, 0.0
    with Dataset(Path(dataroot)) as dataset:
        for name in dataset.scene_names()[int(first) : int(last)]:
            frames = dataset.scene(name, (CAMERA,)).cameras[CAMERA]
            prepared = [prepare(frame, masks, grid) for frame in frames]
            started = time.perf_counter()
            write_bare(Path(out) / f"{name}.h5", prepared, images=False)
            spent += time.perf_counter() - started
    return spent


def read(shards, first, last):
    """Seconds of checksums and decompression, and bytes of the files."""
    started, size = time.perf_counter(), 0
    for path in sorted(Path(shards).glob("*.h5"))[int(first) : int(last)]:
        content = path.read_bytes()
        size += len(content)
        hashlib.sha256(content).hexdigest()
        with h5py.File(path, "r") as h5:
            h5.visititems(_gunzip)
    return {"seconds": time.perf_counter() - started, "bytes": size}


def _gunzip(_, item):
    if isinstance(item, h5py.Dataset) and item.chunks and item.compression == "gzip":
        for number in range(item.id.get_num_chunks()):
            place = item.id.get_chunk_info(number).chunk_offset
            zlib.decompress(item.id.read_direct_chunk(place)[1])


def tables(dataroot):
    """Seconds of reading every table's bytes, and how many they are."""
    started, size = time.perf_counter(), 0
    for path in sorted(Path(dataroot).glob("v1.0-*/*.json")):
        with path.open("rb") as file:
            while part := file.read(PART):
                size += len(part)
    return {"seconds": time.perf_counter() - started, "bytes": size}


if __name__ == "__main__":
    kind, *arguments = sys.argv[1:]
    print(json.dumps({"bare": bare, "read": read, "tables": tables}[kind](*arguments)))
