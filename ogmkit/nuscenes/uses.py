"""Which scene, and which of its cameras, uses a record: damage counts where it is used (design.md §7)."""

from dataclasses import dataclass

from ogmkit.nuscenes.tables import Tables

_KEY_FRAME = """
CREATE OR REPLACE TABLE key_frame AS
SELECT d.rowid AS row, s.scene_token AS scene, e.channel, s.timestamp AS sample_timestamp,
       d.token, d.sample_token, d.ego_pose_token, d.calibrated_sensor_token, c.sensor_token,
       d.timestamp, d.filename, d.width, d.height, p.translation, p.rotation
FROM sample_data d
JOIN sample s ON s.token = d.sample_token
SEMI JOIN scene ON scene.token = s.scene_token
LEFT JOIN calibrated_sensor c ON c.token = d.calibrated_sensor_token
LEFT JOIN sensor e ON e.token = c.sensor_token
LEFT JOIN ego_pose p ON p.token = d.ego_pose_token
WHERE d.is_key_frame IS NOT FALSE AND (e.modality IN ('camera', 'lidar') OR e.channel IS NULL)
"""

# Rows (row, scene, channel) for each table; no channel: every camera of the scene uses the record.
_USES = {
    "scene": "SELECT rowid AS row, token AS scene, NULL::VARCHAR AS channel FROM scene",
    "log": "SELECT l.rowid AS row, s.token AS scene, NULL::VARCHAR AS channel "
    "FROM log l JOIN scene s ON s.log_token = l.token",
    "map": "SELECT m.rowid AS row, s.token AS scene, NULL::VARCHAR AS channel "
    "FROM map m JOIN scene s ON list_contains(m.log_tokens, s.log_token)",
    "sample": "SELECT s.rowid AS row, s.scene_token AS scene, NULL::VARCHAR AS channel "
    "FROM sample s SEMI JOIN scene ON scene.token = s.scene_token",
    "sample_data": "SELECT row, scene, channel FROM key_frame",
    "ego_pose": "SELECT p.rowid AS row, k.scene, k.channel "
    "FROM ego_pose p JOIN key_frame k ON k.ego_pose_token = p.token",
    "calibrated_sensor": "SELECT DISTINCT c.rowid AS row, k.scene, k.channel "
    "FROM calibrated_sensor c JOIN key_frame k ON k.calibrated_sensor_token = c.token",
    "sensor": "SELECT DISTINCT e.rowid AS row, k.scene, k.channel "
    "FROM sensor e JOIN key_frame k ON k.sensor_token = e.token",
    "sample_annotation": "SELECT a.rowid AS row, s.scene_token AS scene, NULL::VARCHAR AS channel "
    "FROM sample_annotation a JOIN sample s ON s.token = a.sample_token "
    "SEMI JOIN scene ON scene.token = s.scene_token "
    # One whose sample is missing belongs where its instance's others do.
    "UNION ALL SELECT lost.rowid AS row, s.scene_token AS scene, NULL::VARCHAR AS channel "
    "FROM sample_annotation lost JOIN sample_annotation a ON a.instance_token = lost.instance_token "
    "JOIN sample s ON s.token = a.sample_token SEMI JOIN scene ON scene.token = s.scene_token "
    "WHERE lost.sample_token IS NULL",
    "instance": "SELECT DISTINCT i.rowid AS row, u.scene, u.channel FROM instance i "
    "JOIN sample_annotation a ON a.instance_token = i.token JOIN sample_annotation_use u ON u.row = a.rowid",
    "category": "SELECT DISTINCT c.rowid AS row, u.scene, u.channel FROM category c "
    "JOIN instance i ON i.category_token = c.token JOIN instance_use u ON u.row = i.rowid",
}


@dataclass(frozen=True)
class Use:
    """What a dataset is used for: what makes that fail is an error, all else a warning.

    Attributes:
        cameras: channels of the cameras whose frames are made.
        images: whether their images are read.
        lidar: channel of the LiDAR whose sweeps are read; None for none.
        maps: whether map masks are read.
        categories: prefixes of the categories that are drawn.
    """

    cameras: tuple[str, ...] = ("CAM_FRONT",)
    images: bool = True
    lidar: str | None = None
    maps: bool = True
    categories: tuple[str, ...] = ("vehicle.",)

    @property
    def channels(self) -> tuple[str, ...]:
        """All channels that are read."""
        return self.cameras if self.lidar is None else (*self.cameras, self.lidar)


@dataclass(frozen=True)
class Query:
    """Finds violations of a rule.

    Attributes:
        table: whose records are to blame.
        sql: gives rows (record, detail, scene, channel): what is wrong with which record, the token of a
            scene whose frames use it (NULL: none) and the camera or LiDAR that does (NULL: all of them).
        probe: a cheaper query that has rows only if `sql` does; most rules are kept.
    """

    table: str
    sql: str
    probe: str


def prepare(tables: Tables) -> None:
    """Create the table `key_frame` and, for each table T, the view `T_use` (row, scene, channel)."""
    tables.execute(_KEY_FRAME)
    for table, sql in _USES.items():
        tables.execute(f"CREATE OR REPLACE VIEW {table}_use AS {sql}")


def used(table: str, found: str) -> Query:
    """A query for violating rows (row, record, detail) of one table, put down to the scenes that use them."""
    if table not in _USES:
        return unused(table, found)
    attributed = (
        f"SELECT f.record, f.detail, u.scene, u.channel FROM ({found}) f "
        f"LEFT JOIN {table}_use u ON u.row = f.row"
    )
    return Query(table, attributed, found)


def placed(table: str, found: str) -> Query:
    """A query whose rows (record, detail, scene, channel) name the scene themselves."""
    return Query(table, found, found)


def unused(table: str, found: str) -> Query:
    """A query for violating rows (row, record, detail) that no frame record is made from."""
    return Query(table, f"SELECT record, detail, NULL AS scene, NULL AS channel FROM ({found})", found)
