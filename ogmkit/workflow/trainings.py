"""The trainings that the file of a run asks for."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import takewhile
from pathlib import Path
from typing import Any

from ogmkit.base.names import unknown
from ogmkit.base.places import place
from ogmkit.base.stated import stated_fields
from ogmkit.base.values import mapping, require_known
from ogmkit.errors import SettingsError
from ogmkit.homography.sources import SURFACE, preferred_source
from ogmkit.learn.catalogue import SystemEntry, all_settings, entry_of, require_read, systems_of
from ogmkit.learn.perception_settings import PERCEPTION_SHAPE, MaskTraining
from ogmkit.learn.planner_settings import HolisticTraining
from ogmkit.learn.presets import preset_values
from ogmkit.shards.additions import require_name
from ogmkit.workflow.config import ELSEWHERE, FOOTPRINTS, HOMOGRAPHY, Config, Training

_PRESET = "preset"


def read_trainings(config: Config, values: Mapping[str, Any], path: Path) -> Config:
    """Add the trainings to a configuration that has everything else.

    Args:
        config: without trainings.
        values: the file's content.
        path: its place.

    Raises:
        SettingsError: a system or setting is unknown or out of range, two trainings have one name, or one
            needs what nothing makes.
    """
    everywhere = f"{path}: train"
    common = mapping(values.get("train"), everywhere)
    _require_here(common, everywhere)
    require_known(common, (_PRESET, *all_settings()), everywhere)
    reader = _Reader(values, path, {"workers": config.readers}, common)
    if HOMOGRAPHY in values:  # decides what the others learn from
        config = replace(config, homography=reader.single(HOMOGRAPHY, {}))
    chosen = preferred_source(config.homographies) or SURFACE
    if FOOTPRINTS in values:
        config = replace(config, footprints=reader.single(FOOTPRINTS, {"masks": chosen}))
    config = replace(
        config, baselines=tuple(reader.listed("baselines", systems_of("grids"), {"masks": chosen}))
    )
    perception = None if config.footprints is None else FOOTPRINTS
    seeing = {"masks": chosen, "warp": chosen, "perception": perception}
    planners = reader.listed("planners", systems_of("plan"), seeing)
    config = replace(config, planners=tuple(planners))
    _require_distinct(config, path)
    config = _placed(config, path)
    for training in config.trainings:
        _require_made(config, training, f"{path}: {training.name}")
        _require_same_shape(config, training, f"{path}: {training.name}")
    return replace(config, notes=_unread(config, common, everywhere))


@dataclass(frozen=True)
class _Reader:
    """Makes trainings of the file's entries.

    Attributes:
        values: the file's content.
        path: its place.
        defaults: of all trainings, whatever the file says.
        common: what it says of all of them.
    """

    values: Mapping[str, Any]
    path: Path
    defaults: Mapping[str, Any]
    common: Mapping[str, Any]

    def single(self, system: str, defaults: Mapping[str, Any]) -> Training:
        """The training that a section of its own describes."""
        where = f"{self.path}: {system}"
        return self._training(system, system, mapping(self.values[system], where), where, defaults)

    def listed(self, name: str, systems: Sequence[str], defaults: Mapping[str, Any]) -> Iterator[Training]:
        """The trainings of a list: names of systems, or settings with `system` and perhaps `name`.

        Args:
            name: the list's.
            systems: that may stand there.
            defaults: of settings, where the system has a network for footprints.
        """
        entries = self.values.get(name) or []
        if not isinstance(entries, list):
            raise SettingsError(f"{self.path}: {name}: not a list of systems")
        for number, entry in enumerate(entries, 1):
            where = f"{self.path}: {name}: {number}"
            values = {"system": entry} if isinstance(entry, str) else mapping(entry, where)
            system = str(values.pop("system", None))
            if system not in systems:
                raise SettingsError(f"{where}: {unknown('system', system, systems)}")
            run = str(values.pop("name", None) or _default_name(system, values))
            yield self._training(run, system, values, f"{self.path}: {name}: {run}", defaults)

    def _training(
        self, name: str, system: str, values: Mapping[str, Any], where: str, defaults: Mapping[str, Any]
    ) -> Training:
        _require_here(values, where)
        entry = entry_of(system)
        try:
            require_read(entry, values)
        except SettingsError as error:
            raise SettingsError(f"{where}: {error}") from error
        shared, own = (_with_preset(entry, some, where) for some in (self.common, values))
        chosen = {**entry.read({**self.defaults, **defaults, **shared}), **own}
        weights = chosen.get("encoder_weights")
        if isinstance(weights, str) and place(weights, self.path.parent).is_file():
            chosen["encoder_weights"] = str(place(weights, self.path.parent).resolve())
        settings = entry.settings.from_values(chosen, where)
        try:
            require_name(name)
        except SettingsError as error:
            raise SettingsError(f"{where}: {error}") from error
        return Training(name, settings)


def _with_preset(entry: SystemEntry, values: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Settings with those of their preset beneath them."""
    own = dict(values)
    name = own.pop(_PRESET, None)
    try:
        return own if name is None else {**preset_values(entry, str(name)), **own}
    except SettingsError as error:
        raise SettingsError(f"{where}: {error}") from error


def _require_here(values: Mapping[str, Any], where: str) -> None:
    for name, instead in ELSEWHERE.items():
        if name in values:
            raise SettingsError(f"{where}: {name}: {instead}")


def _unread(config: Config, common: Mapping[str, Any], where: str) -> tuple[str, ...]:
    """What to say of shared settings that no training of the file reads."""
    read = {name for training in config.trainings for name in stated_fields(type(training.settings))}
    names = [name for name in common if name not in read and name != _PRESET]
    if not names:
        return ()
    return (f"{where}: no training here reads {', '.join(names)}; ignored",)


def _default_name(system: str, values: Mapping[str, Any]) -> str:
    if system == FOOTPRINTS and values.get("masks") is not None:
        return f"{system}-{values['masks']}"
    marks = {"no_past": "-np", "no_destination": "-nd"}
    return system + "".join(mark for name, mark in marks.items() if values.get(name) is True)


def _placed(config: Config, path: Path) -> Config:
    """The configuration whose trainings know the runs that they start from."""
    homography, footprints = (
        one and _placed_training(config, one, path) for one in (config.homography, config.footprints)
    )
    return replace(
        config,
        homography=homography,
        footprints=footprints,
        baselines=tuple(_placed_training(config, one, path) for one in config.baselines),
        planners=tuple(_placed_training(config, one, path) for one in config.planners),
    )


def _placed_training(config: Config, training: Training, path: Path) -> Training:
    """The training with runs to start from that are the file's trainings, or places relative to the file."""
    earlier = takewhile(lambda one: one.name != training.name, config.trainings)
    known = {one.name: one.settings.system for one in earlier if one in config.grids}
    places: dict[str, Any] = {}
    for name, run in training.settings.runs_read.items():
        here = [one for one, system in known.items() if name == "init" or system == FOOTPRINTS]
        if run in here:
            continue
        found = place(run, path.parent).resolve()
        if not found.exists():
            raise SettingsError(
                f"{path}: {training.name}: {name}: {run!r} is neither a training here that it can start from "
                f"(there are: {', '.join(here) or 'none'}) nor a path of one"
            )
        places[name] = str(found)
    return replace(training, settings=replace(training.settings, **places))


def _require_distinct(config: Config, path: Path) -> None:
    names = [training.name for training in config.trainings]
    for name in names:
        if names.count(name) > 1:
            raise SettingsError(f"{path}: two trainings are called {name}; give one another `name`")


def _require_made(config: Config, training: Training, where: str) -> None:
    """Refuse what learns from homographies or masks that the run doesn't make."""
    settings = training.settings
    # What others learn from comes first: the network's own homographies are there for planners only.
    known = config.homographies if isinstance(settings, HolisticTraining) else config.methods
    for name, source in settings.homographies_read.items():
        if source not in known:
            raise SettingsError(
                f"{where}: {name}: nothing makes homographies {source!r}; there are: {', '.join(known)}; "
                "homography_fit: methods adds some"
            )
    if settings.masks_learnt is not None:
        try:
            config.footprint_set(settings.masks_learnt)
        except SettingsError as error:
            raise SettingsError(f"{where}: masks: {error}; homography_fit: methods adds some") from error


def _require_same_shape(config: Config, training: Training, where: str) -> None:
    """Refuse a perception whose weights won't fit, before days have gone into it."""
    settings = training.settings
    if not isinstance(settings, HolisticTraining):
        return
    for one in config.grids:
        if one.name != settings.perception or not isinstance(one.settings, MaskTraining):
            continue
        for name in PERCEPTION_SHAPE:
            found, wanted = getattr(one.settings, name), getattr(settings, name)
            if found != wanted:
                raise SettingsError(
                    f"{where}: {name}: {wanted} can't begin with {one.name}, which has {found}"
                )
