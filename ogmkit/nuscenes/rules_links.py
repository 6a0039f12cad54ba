"""Rules about sequences: chains of key frames, their sensors and times, and other prev/next links."""

from ogmkit.nuscenes.uses import placed, unused, used


def _broken_links(table: str, *, same: str) -> str:
    """Rows whose `next` or `prev` doesn't lead to a row of the same scene or object that leads back."""
    return " UNION ALL ".join(
        f"SELECT t.rowid AS row, t.token AS record, '{there} ''' || t.{there} || ''' is not a neighbour "
        f"whose {back} leads back' AS detail FROM {table} t LEFT JOIN {table} n ON n.token = t.{there} "
        f"WHERE t.{there} <> '' AND (n.{back} = t.token AND n.{same} = t.{same}) IS NOT TRUE"
        for there, back in (("next", "prev"), ("prev", "next"))
    )


# With every link mutual, one start and one end, what is left could only form circles: those run against time.
CHAINS = (
    used("sample", _broken_links("sample", same="scene_token")),
    used(
        "scene",
        """
        SELECT c.rowid AS row, c.token AS record, CASE
            WHEN f.frames IS NULL THEN 'has no key frame'
            WHEN f.frames <> c.nbr_samples
                THEN f.frames || ' key frames, but nbr_samples is ' || c.nbr_samples
            WHEN f.starts = 0 OR f.ends = 0 THEN 'prev/next of its key frames run in a circle'
            WHEN f.starts > 1 OR f.ends > 1 THEN 'its key frames form several chains'
            ELSE 'first_sample_token or last_sample_token is not the end of its chain' END AS detail
        FROM scene c LEFT JOIN (
            SELECT scene_token, count(*) AS frames,
                count(*) FILTER (prev = '') AS starts, min(token) FILTER (prev = '') AS first_token,
                count(*) FILTER (next = '') AS ends, min(token) FILTER (next = '') AS last_token
            FROM sample GROUP BY scene_token
        ) f ON f.scene_token = c.token
        WHERE (f.frames = c.nbr_samples AND f.starts = 1 AND f.ends = 1
            AND f.first_token = c.first_sample_token AND f.last_token = c.last_sample_token) IS NOT TRUE""",
    ),
)
SENSORS = (
    placed(
        "sample",
        """
        SELECT s.token AS record, 'has no key-frame data of ' || p.channel AS detail, p.scene, p.channel
        FROM sample s
        JOIN (SELECT DISTINCT scene, channel FROM key_frame WHERE channel IS NOT NULL) p
            ON p.scene = s.scene_token
        ANTI JOIN key_frame k ON k.sample_token = s.token AND k.channel = p.channel""",
    ),
    placed(
        "sample",
        """
        SELECT sample_token AS record, 'has ' || count(*) || ' key-frame data of ' || channel AS detail,
            scene, channel
        FROM key_frame WHERE channel IS NOT NULL
        GROUP BY sample_token, channel, scene HAVING count(*) > 1""",
    ),
)
TIMES = (
    used(
        "sample",
        """
        SELECT n.rowid AS row, n.token AS record, 'timestamp ' || n.timestamp || ' does not follow '
            || s.timestamp || ' of the key frame before (or prev/next run in a circle)' AS detail
        FROM sample s JOIN sample n ON n.token = s.next AND n.scene_token = s.scene_token
        WHERE n.timestamp <= s.timestamp""",
    ),
    placed(
        "sample_data",
        """
        SELECT token AS record, 'timestamp ' || timestamp || ' of ' || channel || ' does not follow '
            || before || ' of the key frame before' AS detail, scene, channel
        FROM (
            SELECT token, timestamp, scene, channel,
                lag(timestamp) OVER (PARTITION BY scene, channel ORDER BY sample_timestamp, row) AS before
            FROM key_frame WHERE channel IS NOT NULL
        ) WHERE timestamp <= before""",
    ),
)
IMAGE_LINKS = (unused("sample_data", _broken_links("sample_data", same="calibrated_sensor_token")),)
ANNOTATION_LINKS = (unused("sample_annotation", _broken_links("sample_annotation", same="instance_token")),)
INSTANCES = (
    unused(
        "instance",
        """
        SELECT i.token AS record, coalesce(a.found, 0) || ' annotations in '
            || 'sample_annotation.json, but nbr_annotations is ' || i.nbr_annotations AS detail
        FROM instance i LEFT JOIN (
            SELECT instance_token, count(*) AS found FROM sample_annotation GROUP BY instance_token
        ) a ON a.instance_token = i.token
        WHERE coalesce(a.found, 0) <> i.nbr_annotations""",
    ),
)
