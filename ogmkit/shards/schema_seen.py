"""The part of the schema that holds masks of cells that are seen, `/<CAMERA>/seen/…` (`extract --seen`)."""

from ogmkit.shards.fields import COLUMNS, FRAMES, ROWS, Field

SEEN = "seen"
SEEN_FIELDS = (
    Field(
        "seen/rays",
        "uint8",
        (FRAMES, ROWS, COLUMNS),
        "1 where the cell's centre is in view, and no box but its own hides it from the camera",
        "",
        "bev",
        "rays",
    ),
    Field(
        "seen/lidar",
        "uint8",
        (FRAMES, ROWS, COLUMNS),
        "1 where the cell's centre is in view, no farther from the LiDAR than a point of its 0.2° sector",
        "",
        "bev",
        "reach",
    ),
    Field(
        "seen/lidar_centre_level",
        "float64",
        (FRAMES, 3),
        "where the LiDAR was when it swept",
        "m",
        "level",
        "reach",
    ),
)
