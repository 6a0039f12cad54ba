"""Makes the pictures of README.md and of docs/ that need no training: `make pictures`."""

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

DOCS = Path(__file__).resolve().parent
DATA = DOCS.parent / "fixtures" / "nuscenes-synthetic"
OGMKIT = str(Path(sys.executable).with_name("ogmkit"))
DEFINITIONS = "lss,fiery,cvt,pon,bevfusion,pointbev,stp3"
WIDTH = 1400
QUALITY = 88


def main() -> None:
    """Replace the pictures."""
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        shards, sheets = work / "shards", work / "sheets"
        ogmkit("extract", DATA, shards, "--scenes", "scene-0001")
        ogmkit("homography-fit", shards, "--method", "surface")
        ogmkit("render-footprints", shards)
        ogmkit("render-footprints", shards, "--method", "full-body")
        ogmkit("preview", shards, "--out", sheets, "--frames", "4")
        keep(sheets / "scene-0001_CAM_FRONT.png", "preview.jpg")
        ogmkit("preview", shards, "--out", sheets, "--view", "stretch", "--frames", "2")
        keep(sheets / "scene-0001_CAM_FRONT_stretch_surface.png", "stretch.jpg")
        labels = work / "labels.png"
        ogmkit(
            *("compare-labels", DATA, "--definition", DEFINITIONS, "--scenes", "scene-0001"),
            *("--picture", labels),
        )
        keep(labels, "definitions.jpg")


def ogmkit(*arguments: object) -> None:
    """Run a command."""
    subprocess.run([OGMKIT, *map(str, arguments)], check=True)


def keep(sheet: Path, name: str, width: int = WIDTH) -> None:
    """Keep a sheet as a JPEG, of the pages' width unless it is told another."""
    with Image.open(sheet) as image:
        size = width, round(image.height * width / image.width)
        image.convert("RGB").resize(size, Image.Resampling.LANCZOS).save(DOCS / name, quality=QUALITY)


if __name__ == "__main__":
    main()
