"""How much of an object is seen: `visibility_token` is a key into visibility.json, whose level says it."""

LEVELS = {
    "v0-40": 1,
    "v40-60": 2,
    "v60-80": 3,
    "v80-100": 4,
    "none": 1,
    "partial": 2,
    "most": 3,
    "full": 4,
}
"""Text of a level, of nuScenes and of T4 → its number; any other text is 0, unknown."""

_CASES = " ".join(f"WHEN '{text}' THEN {number}" for text, number in LEVELS.items())

BY_TOKEN = (
    f"(SELECT token, max(CASE lower(trim(level)) {_CASES} ELSE 0 END) AS number, min(level) AS level "
    "FROM visibility GROUP BY token)"
)
"""SQL: rows (token, number, level), one for each token of visibility.json."""
