"""The other half of the table: which files are broken, how, and who reads them."""

from dataclasses import dataclass

from harness import mutate
from harness.mutate import Mutator


@dataclass(frozen=True)
class Broken:
    """A kind of broken input.

    Attributes:
        name: of the kind.
        files: pattern of the files in the scenario's folder, of which one is broken.
        ways: how; one is drawn.
        readers: scenarios that read them; one is drawn.
        checked: whether a checksum covers every byte, so that a run may succeed only with the sound result.
        cases: how many are tried.
        slow: its readers are, so that short samples leave it out.
    """

    name: str
    files: str
    ways: tuple[Mutator, ...]
    readers: tuple[str, ...]
    checked: bool = False
    cases: int = 400
    slow: bool = False


_BIT = (mutate.flip,)

BROKEN = {
    one.name: one
    for one in (
        Broken(
            "table values",
            "world/v1.0-mini/*.json",
            (mutate.change_json,),
            ("check", "extract with masks", "inspect dataset"),
            cases=400,
        ),
        Broken(
            "table bytes",
            "world/v1.0-mini/*.json",
            (mutate.damage, mutate.disarrange),
            ("check", "extract with masks"),
            cases=250,
        ),
        Broken(
            "splits",
            "world/splits.json",
            (mutate.change_json, mutate.damage),
            ("extract with masks", "inspect dataset"),
        ),
        Broken(
            "images",
            "world/samples/CAM_FRONT/*.jpg",
            (mutate.damage, mutate.disarrange),
            ("check", "extract with masks"),
            cases=150,
        ),
        Broken(
            "sweeps",
            "world/samples/LIDAR_TOP/*.bin",
            (mutate.damage, mutate.disarrange),
            ("check", "extract with masks"),
            cases=150,
        ),
        Broken("map masks", "world/maps/*.png", (mutate.damage, mutate.disarrange), ("extract",), cases=100),
        Broken(
            "decoded masks", "cache/*.mask", (mutate.damage,), ("extract again",), checked=True, cases=200
        ),
        Broken(
            "shard bytes",
            "shards/*.h5",
            (mutate.damage,),
            ("verify", "homography-fit", "inspect shard", "extract again"),
            cases=600,
        ),
        Broken(
            "shard values",
            "shards/*.h5",
            (mutate.change_h5,),
            ("verify", "homography-fit", "inspect shards"),
            cases=1200,
        ),
        Broken(
            "shards with homographies",
            "fitted/*.h5",
            (mutate.change_h5, mutate.damage),
            ("render-footprints",),
            cases=800,
        ),
        Broken(
            "shards with footprints",
            "rendered/*.h5",
            (mutate.change_h5, mutate.damage),
            ("preview", "view"),
            cases=300,
        ),
        Broken(
            "shards of plans",
            "plans/*.h5",
            (mutate.change_h5, mutate.damage),
            ("evaluate planner", "predict plans"),
            cases=150,
        ),
        Broken(
            "manifest values",
            "shards/manifest.json",
            (mutate.change_json,),
            ("verify", "inspect shards", "homography-fit", "extract again"),
        ),
        Broken(
            "manifest bytes",
            "shards/manifest.json",
            (mutate.damage,),
            ("verify", "inspect shards", "homography-fit"),
            checked=True,
        ),
        Broken("chain file", "chain.yaml", (mutate.change_yaml, mutate.damage), ("plan of run",), cases=800),
        Broken(
            "settings file",
            "settings.yaml",
            (mutate.change_yaml, mutate.damage),
            ("print settings",),
            cases=800,
        ),
        Broken(
            "run's settings",
            "planner/config.yaml",
            (mutate.change_yaml, mutate.damage),
            ("inspect run", "train on"),
        ),
        Broken(
            "run's figures",
            "planner/metrics.csv",
            (mutate.damage, mutate.disarrange),
            ("inspect run", "train on"),
            cases=250,
        ),
        Broken(
            "run's splits",
            "planner/splits.json",
            (mutate.change_json, mutate.damage),
            ("inspect run", "train on"),
        ),
        Broken(
            "calibration",
            "past.json",
            (mutate.change_json, mutate.damage),
            ("predict plan of calibration",),
            cases=800,
        ),
        Broken(
            "calibration of a camera",
            "camera.json",
            (mutate.change_json, mutate.damage),
            ("predict masks of files",),
            slow=True,
            cases=200,
        ),
        Broken(
            "images to predict on",
            "images/*.jpg",
            (mutate.damage, mutate.disarrange),
            ("predict masks of files",),
            slow=True,
            cases=200,
        ),
        Broken(
            "checkpoint bytes",
            "planner/*.ckpt",
            (mutate.damage,),
            ("predict plans", "evaluate planner", "inspect checkpoint"),
            checked=True,
            cases=300,
        ),
        Broken(
            "checkpoint content",
            "planner/*.ckpt",
            (mutate.change_checkpoint,),
            ("predict plans", "evaluate planner", "inspect checkpoint"),
            cases=400,
        ),
        Broken(
            "weights to start from",
            "planner/best.ckpt",
            (mutate.damage, mutate.change_checkpoint),
            ("train from",),
            cases=300,
        ),
        Broken(
            "weights of an encoder",
            "encoder.pth",
            (mutate.damage,),
            ("train network",),
            cases=200,
            slow=True,
        ),
        Broken("bits of a checkpoint", "planner/*.ckpt", _BIT, ("predict plans",), checked=True, cases=200),
        Broken("bits of a manifest", "shards/manifest.json", _BIT, ("verify",), checked=True, cases=200),
        Broken("bits of a decoded mask", "cache/*.mask", _BIT, ("extract again",), checked=True, cases=200),
    )
}
"""Kinds by name; a new one is a line here."""
