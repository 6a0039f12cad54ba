"""The reference of all settings, made from what the records' fields state."""

from collections.abc import Iterator
from typing import Any, get_type_hints

from ogmkit.base.stated import Stated, choices_of, stated_fields
from ogmkit.evaluation.settings import EvaluateSettings
from ogmkit.footprints.settings import FootprintSettings
from ogmkit.grid import GridSpec
from ogmkit.homography.settings import FitSettings
from ogmkit.learn.catalogue import CATALOGUE, all_settings, readers
from ogmkit.learn.presets import PRESETS
from ogmkit.pictures.settings import PreviewSettings
from ogmkit.report.settings import ReportSettings
from ogmkit.shards.settings import ExtractSettings
from ogmkit.synthetic.settings import SynthesisSettings
from ogmkit.target_settings import TargetSettings

_COMMANDS = {
    "synthesize": (SynthesisSettings,),
    "extract": (GridSpec, TargetSettings, ExtractSettings),
    "homography-fit": (FitSettings,),
    "render-footprints": (FootprintSettings,),
    "evaluate": (EvaluateSettings,),
    "preview": (PreviewSettings,),
    "report": (ReportSettings,),
}


def settings_markdown() -> str:
    """Tables of the settings of all commands, as docs/settings.md has them."""
    return "\n".join((*_command_tables(), *_training_table(), *_preset_table()))


def _command_tables() -> Iterator[str]:
    for command, records in _COMMANDS.items():
        yield from (f"## `{command}`", "")
        yield from ("| setting | option | default | range | meaning |", "| --- | --- | --- | --- | --- |")
        for record in records:
            for name, stated in stated_fields(record).items():
                yield _row(record, name, stated, (_shown(getattr(record(), name), stated),))
        yield ""


def _training_table() -> Iterator[str]:
    yield from ("## `train`", "")
    yield "| setting | option | default | range | meaning | systems |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for name, stated in all_settings().items():
        systems = readers(name)
        defaults = {system: _shown(getattr(CATALOGUE[system].settings(), name), stated) for system in systems}
        usual = max(defaults.values(), key=list(defaults.values()).count)
        others = [value for value in dict.fromkeys(defaults.values()) if value != usual]
        listed = (f"{value} ({', '.join(s for s in systems if defaults[s] == value)})" for value in others)
        row = _row(CATALOGUE[systems[0]].settings, name, stated, (usual, *listed))
        yield f"{row} {'all' if len(systems) == len(CATALOGUE) else ', '.join(systems)} |"


def _preset_table() -> Iterator[str]:
    """What each preset sets, other than the paper's."""
    names = {name: values for name, values in PRESETS.items() if values}
    stated = all_settings()
    yield from ("", "### Presets", "")
    yield f"| setting | {' | '.join(f'`--preset {name}`' for name in names)} |"
    yield f"| --- |{' --- |' * len(names)}"
    for setting in dict.fromkeys(setting for values in names.values() for setting in values):
        shown = (_shown(values[setting], stated[setting]) for values in names.values())
        yield f"| `{setting}` | {' | '.join(shown)} |"


def _row(record: type[Any], name: str, stated: Stated, defaults: tuple[str, ...]) -> str:
    flag = " ".join(f"`{flag}`" for flag in stated.flags(name))
    values = choices_of(get_type_hints(record)[name])
    allowed = ", ".join(f"`{value}`" for value in values) or stated.range
    return f"| `{name}` | {flag} | {'; '.join(defaults)} | {allowed} | {stated.help} |"


def _shown(value: object, stated: Stated) -> str:
    if value is None or value == ():
        return stated.unset
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        joined = "x" if "x" in stated.form else ","
        return stated.unset or joined.join(map(str, value))
    return f"{value:g}" if isinstance(value, float) else str(value)
