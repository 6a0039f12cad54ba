"""The table of commands that are put to the test, with what they read; a new one is a line here.

Inputs that are broken on purpose are in `harness/broken.py`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from harness import templates

Make = Callable[[Path], None]
Pace = Literal["quick", "steady", "slow"]
"""Below half a second, below one or two, and above, torch loaded."""


@dataclass(frozen=True)
class Scenario:
    """A command that is disturbed.

    Attributes:
        name: of the scenario.
        arguments: of `ogmkit`, in a folder that holds `inputs`.
        inputs: names of templates that are copied there; the command may write into them.
        kept: those of them that no fault may change.
        speaks: whether what it writes to stdout is its result.
        verified: the folder of shards that `ogmkit verify` must find sound.
        pace: how long it takes, by which fewer or more of its faults are tried.
        uncompared: files that hold times.
    """

    name: str
    arguments: tuple[str, ...]
    inputs: tuple[str, ...] = ()
    kept: tuple[str, ...] = ()
    speaks: bool = False
    verified: str = ""
    pace: Pace = "quick"
    uncompared: tuple[str, ...] = ()

    @property
    def needs_torch(self) -> bool:
        """Whether it imports what makes every later fork slow."""
        return self.arguments[0] in ("train", "predict", "evaluate", "adapt", "export", "run", "doctor")

    @property
    def names(self) -> set[str]:
        """What it is called with: names that a good message may have."""
        return {*self.inputs, *self.arguments, *(Path(one).stem for one in self.arguments)} - {"-", ""}


def _scenario(line: str, inputs: str = "", kept: str = "", **more: object) -> Scenario:
    name, _, arguments = line.partition(": ")
    return Scenario(name, tuple(arguments.split()), tuple(inputs.split()), tuple(kept.split()), **more)  # type: ignore[arg-type]


_SMALL = "--cell-size 0.5 --rows 60 --columns 40"
_NETWORK = "--image-size 64x96 --encoder tu-test_resnet --batch-size 2 --max-steps 1 --workers 0"

SCENARIOS = {
    one.name: one
    for one in (
        _scenario(
            "synthesize: synthesize made --num-scenes 1 --frames 1 --camera CAM_FRONT --no-lidar "
            "--image-size 45x80",
            pace="slow",
        ),
        _scenario("check: check world --json", "world", "world", speaks=True, pace="steady"),
        _scenario(
            "splits: splits world --out apart.json --apart 0 --test-share 0 --json",
            "world",
            "world",
            speaks=True,
        ),
        _scenario("inspect dataset: inspect world --json", "world", "world", speaks=True),
        _scenario(
            f"extract: extract world out {_SMALL} --lidar --cache-dir cache",
            "world",
            "world",
            verified="out",
            pace="steady",
        ),
        _scenario(
            f"extract with masks: extract world out {_SMALL} --lidar --cache-dir cache",
            "world cache",
            "world",
            verified="out",
            pace="steady",
        ),
        _scenario(
            f"extract again: extract world shards {_SMALL} --lidar --overwrite --cache-dir cache",
            "world shards cache",
            "world",
            verified="shards",
            pace="steady",
        ),
        _scenario(
            "extract labels: extract world out --definition lss,fiery,pon --no-map",
            "world",
            "world",
            verified="out",
            pace="steady",
        ),
        _scenario(
            "compare labels: compare-labels world --definition lss,cvt --no-map --picture labels.png --json",
            "world",
            "world",
            speaks=True,
            pace="steady",
        ),
        _scenario("export shards: export-shards shards tars --format webdataset", "shards", "shards"),
        _scenario("export cvt: export-cvt world labels", "world", "world", pace="steady"),
        _scenario("verify: verify shards --json", "shards", "shards", speaks=True),
        _scenario("inspect shards: inspect shards --json", "shards", "shards", speaks=True),
        _scenario("inspect shard: inspect shards/scene-0001.h5 --json", "shards", "shards", speaks=True),
        _scenario(
            "homography-fit: homography-fit shards --method surface,dlt --plot errors.png",
            "shards",
            verified="shards",
            pace="steady",
        ),
        _scenario("render-footprints: render-footprints fitted", "fitted", verified="fitted", pace="steady"),
        _scenario(
            "preview: preview rendered --out pictures --view targets,footprints --frames 1",
            "rendered",
            "rendered",
            pace="slow",
        ),
        _scenario(
            "report: report rendered --out report.html --frames 1 --no-check",
            "rendered",
            "rendered",
            pace="slow",
        ),
        _scenario(
            "view: view rendered --save scenes.rrd --overwrite",
            "rendered",
            "rendered",
            pace="slow",
            uncompared=("scenes.rrd",),
        ),
        _scenario("cache: cache --cache-dir cache --json", "cache", "cache", speaks=True),
        _scenario("cache clear: cache --cache-dir cache --clear", "cache"),
        _scenario("doctor: doctor --json", "cache", "cache"),
        _scenario(
            "train planner: train lstm-ed plans --out run --batch-size 2 --limit-frames 4 --max-steps 3 "
            "--checkpoint-every 1 --workers 0",
            "plans",
            "plans",
            pace="steady",
        ),
        _scenario(
            "train on: train lstm-ed plans --out planner --limit-frames 2 --epochs 1 --workers 0",
            "plans planner",
            "plans",
            pace="steady",
        ),
        _scenario(
            "train from: train lstm-ed plans --out run --init planner --limit-frames 2 --max-steps 1 "
            "--workers 0",
            "plans planner",
            "plans planner",
            pace="steady",
        ),
        _scenario(
            "print settings: train lstm-ed plans --config settings.yaml --print-config",
            "plans settings.yaml",
            "plans",
            speaks=True,
        ),
        _scenario("plan of run: run chain.yaml --plan --json", "world chain.yaml", "world", speaks=True),
        _scenario("inspect checkpoint: inspect planner/best.ckpt --json", "planner", "planner", speaks=True),
        _scenario("inspect run: inspect planner --json", "planner", "planner", speaks=True),
        _scenario(
            "predict plans: predict plan plans --checkpoint planner --out plans.json",
            "plans planner",
            "plans planner",
        ),
        _scenario(
            "predict plan of calibration: predict plan images --checkpoint planner --calibration past.json",
            "images planner past.json",
            "images planner past.json",
            speaks=True,
        ),
        _scenario(
            "evaluate planner: evaluate plans planner --format json",
            "plans planner",
            "plans planner",
            speaks=True,
            pace="steady",
        ),
        _scenario(
            "evaluate floor: evaluate rendered --format json",
            "rendered",
            "rendered",
            speaks=True,
            pace="slow",
        ),
        _scenario(
            f"train network: train footprints rendered --out run {_NETWORK} --encoder-weights encoder.pth",
            "rendered encoder.pth",
            "rendered encoder.pth",
            pace="slow",
        ),
        _scenario(
            "predict homographies: predict homography fitted --checkpoint network",
            "fitted network",
            "network",
            verified="fitted",
            pace="slow",
        ),
        _scenario(
            "predict masks: predict footprints fitted --checkpoint masks --out predicted --format png",
            "fitted masks",
            "fitted masks",
            pace="slow",
        ),
        _scenario(
            "predict masks of files: predict footprints images --checkpoint masks --out predicted "
            "--calibration camera.json",
            "images masks camera.json",
            "images masks camera.json",
            pace="slow",
        ),
        _scenario(
            "adapt: adapt network images --out adapted",
            "network images",
            "network images",
            pace="slow",
        ),
        _scenario(
            "export: export network --out model.onnx",
            "network",
            "network",
            pace="slow",
        ),
        _scenario(
            "run: run chain.yaml",
            "world chain.yaml",
            "world",
            pace="slow",
            verified="chain/shards",
            uncompared=("chain/manifest.json",),
        ),
    )
}
"""Commands by name; slow ones at the end."""


TEMPLATES: dict[str, tuple[tuple[str, ...], Make]] = {
    "world": ((), templates.world),
    "long": ((), templates.long_world),
    "cache": (("world",), templates.cache),
    "shards": (
        ("world",),
        templates.command(f"extract world shards {_SMALL} --lidar --cache-dir masks-of-world"),
    ),
    "fitted": (("shards",), templates.command("homography-fit fitted --method surface", "shards", "fitted")),
    "rendered": (("fitted",), templates.command("render-footprints rendered", "fitted", "rendered")),
    "plans": (
        ("long",),
        templates.command(f"extract long plans {_SMALL} --images none --cache-dir masks-of-long"),
    ),
    "planner": (
        ("plans",),
        templates.command("train lstm-ed plans --out planner --limit-frames 2 --epochs 1 --workers 0"),
    ),
    "network": (
        ("fitted",),
        templates.command(f"train homography fitted --out network {_NETWORK}"),
    ),
    "masks": (
        ("rendered",),
        templates.command(f"train footprints rendered --out masks {_NETWORK}"),
    ),
    "encoder.pth": ((), templates.encoder),
    "images": ((), templates.images),
    "past.json": ((), templates.past),
    "camera.json": ((), templates.camera),
    "chain.yaml": ((), templates.chain),
    "settings.yaml": (("plans",), templates.settings),
}
"""What scenarios read: what each needs first, and how it is made in a folder of all."""
