"""Every stage's settings together: their defaults, a TOML file that changes some, and how that file looks."""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import Field, asdict, dataclass, field, fields, is_dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from solver.capture.marker_cleaning import MarkerCleaningSettings
from solver.capture.plates.force_settings import ConditioningSettings
from solver.capture.trial import ReadingSettings
from solver.common.errors import SettingsError
from solver.common.small_files import BrokenFileError, lies_there, toml_tables
from solver.contact.detection_settings import DetectionSettings
from solver.contact.settings import ContactSettings
from solver.dynamics.com_settings import ComSettings
from solver.dynamics.force_prediction.settings import PredictionSettings
from solver.dynamics.settings import DynamicsSettings
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.fitting.diagnosis_settings import DiagnosisSettings
from solver.kinematics.label_faults.settings import LabelRepairSettings
from solver.kinematics.settings import KinematicsSettings

_NO_FIT_OBEYS = "diagnosis"  # the table that a diagnosis alone obeys
FILE_NAME = "settings.toml"  # in the subject's folder; read where no other file is named


@dataclass(frozen=True)
class Settings:
    """One frozen dataclass a stage; a table of the TOML file carries the field's name."""

    cleaning: MarkerCleaningSettings = field(default_factory=MarkerCleaningSettings)
    label_repair: LabelRepairSettings = field(default_factory=LabelRepairSettings)
    kinematics: KinematicsSettings = field(default_factory=KinematicsSettings)
    conditioning: ConditioningSettings = field(default_factory=ConditioningSettings)
    contact: ContactSettings = field(default_factory=ContactSettings)
    detection: DetectionSettings = field(default_factory=DetectionSettings)
    com: ComSettings = field(default_factory=ComSettings)
    trajectory: TrajectorySettings = field(default_factory=TrajectorySettings)
    prediction: PredictionSettings = field(default_factory=PredictionSettings)
    dynamics: DynamicsSettings = field(default_factory=DynamicsSettings)
    diagnosis: DiagnosisSettings = field(default_factory=DiagnosisSettings)

    @property
    def reading(self) -> ReadingSettings:
        """The tables that reading a trial's files obeys, together."""
        return ReadingSettings(**{part.name: getattr(self, part.name) for part in fields(ReadingSettings)})


def settings_for(subject_folder: Path, file: Path | None = None) -> Settings:
    """The settings of a solve: those of `file`, else of the subject's settings.toml, else the defaults.

    Raises:
        SettingsError: the file is no TOML, or a key or value in it is not one of ours, or what bears its name
            cannot be read.
    """
    own = subject_folder / FILE_NAME
    try:
        if file is None and not lies_there(own):
            return Settings()
    except BrokenFileError as error:
        raise SettingsError(f"{own}: {error}") from error
    except OSError as error:
        raise SettingsError(f"{own}: cannot be read ({error.strerror}).") from error
    return read_settings(file or own)


def read_settings(path: Path) -> Settings:
    """The defaults with the changes of a TOML file.

    Raises:
        SettingsError: the file is no TOML, or a key or value in it is not one of ours.
    """
    try:
        tables = toml_tables(path)
    except BrokenFileError as error:
        raise SettingsError(f"{path}: not a TOML file: {error}") from error
    except OSError as error:
        raise SettingsError(f"{path}: cannot be read ({error.strerror}).") from error
    return settings_from(tables, path)


def settings_from(tables: Mapping[str, object], said_in: Path | str) -> Settings:
    """The defaults with the changes of tables as a TOML file has them.

    Args:
        tables: by name; of each, values by key.
        said_in: where they stand, for messages.

    Raises:
        SettingsError: a key or value is not one of ours.
    """
    defaults = Settings()
    stages = {f.name: f for f in fields(defaults)}
    changed = {}
    for name, table in tables.items():
        if name not in stages:
            raise SettingsError(f"{said_in}: unknown table [{name}]; {_nearest(name, stages)}")
        if not isinstance(table, dict):
            raise SettingsError(f"{said_in}: '{name}' must be a table: [{name}]")
        changed[name] = _stage(said_in, name, getattr(defaults, name), table)
    return replace(defaults, **changed)


def as_dict(settings: Settings) -> dict[str, object]:
    """Plain values by stage and name, as a fit keeps them: what JSON gives back unchanged."""
    plain: dict[str, object] = _listed(asdict(settings))
    return plain


def from_dict(kept: Mapping[str, object]) -> Settings:
    """The settings that `as_dict` wrote; what an older version does not name has its default."""
    restored: Settings = _restored(Settings(), kept)
    return restored


def decide_the_same_fit(kept: Mapping[str, object], settings: Settings) -> bool:
    """Whether a fit that keeps these settings would come out the same: none obeys the diagnosis' own."""
    return {**kept, _NO_FIT_OBEYS: None} == {**as_dict(settings), _NO_FIT_OBEYS: None}


def by_name(kept: Mapping[str, Any], prefix: str = "") -> dict[str, object]:
    """Values of `as_dict` by dotted name, as in "diagnosis.markers.time_s"."""
    flat: dict[str, object] = {}
    for key, value in kept.items():
        if isinstance(value, Mapping):
            flat |= by_name(value, f"{prefix}{key}.")
        else:
            flat[prefix + key] = value
    return flat


def as_toml(settings: Settings) -> str:
    """A TOML file that gives these settings, each with its unit and the reason for its default."""
    return "\n".join(_table(name, stage) for name, stage in tables(settings))


def tables(settings: Settings) -> Iterator[tuple[str, Any]]:
    """Name and dataclass of every table of the TOML file, those within a stage after it."""
    for f in fields(settings):
        yield from _with_inner(f.name, getattr(settings, f.name))


def _with_inner(name: str, stage: Any) -> Iterator[tuple[str, Any]]:
    yield name, stage
    for f in fields(stage):
        if is_dataclass(value := getattr(stage, f.name)):
            yield from _with_inner(f"{name}.{f.name}", value)


def _listed(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _listed(own) for key, own in value.items()}
    return [_listed(item) for item in value] if isinstance(value, tuple | list) else value


def _restored(defaults: Any, kept: object) -> Any:
    if not isinstance(kept, Mapping):
        return defaults
    known = {f.name: getattr(defaults, f.name) for f in fields(defaults) if f.name in kept}
    return replace(
        defaults,
        **{
            name: _restored(own, kept[name]) if is_dataclass(own) else _with_tuples(kept[name])
            for name, own in known.items()
        },
    )


def _with_tuples(value: Any) -> Any:
    return tuple(_with_tuples(item) for item in value) if isinstance(value, list | tuple) else value


def _stage(path: Path | str, name: str, defaults: Any, table: Mapping[str, object]) -> Any:
    kinds, inner = get_type_hints(type(defaults)), {}
    bounds = {f.name: f.metadata["bounds"] for f in fields(defaults) if "bounds" in f.metadata}
    for key, value in table.items():
        if key not in kinds:
            raise SettingsError(f"{path}: unknown setting '{key}' in [{name}]; {_nearest(key, kinds)}")
        if is_dataclass(kinds[key]):
            if not isinstance(value, dict):
                raise SettingsError(f"{path}: '{key}' in [{name}] must be a table: [{name}.{key}]")
            inner[key] = _stage(path, f"{name}.{key}", getattr(defaults, key), value)
        elif not _fits(value, kinds[key]):
            raise SettingsError(
                f"{path}: [{name}] {key} = {_toml(value)}: expected {_described(kinds[key])}, "
                f"as in {key} = {_toml(getattr(defaults, key))}"
            )
        elif key in bounds and not bounds[key].allow(value):
            raise SettingsError(
                f"{path}: [{name}] {key} = {_toml(value)}: expected {_bounded(kinds[key])} {bounds[key]}, "
                f"as in {key} = {_toml(getattr(defaults, key))}"
            )
    plain = {key: _converted(value, kinds[key]) for key, value in table.items() if key not in inner}
    return replace(defaults, **plain, **inner)


def _bounded(kind: Any) -> str:
    return "numbers, each" if get_origin(kind) is tuple else _described(kind)


def _nearest(name: str, known: Mapping[str, object]) -> str:
    near = get_close_matches(name, known)
    return f"nearest: {', '.join(near)}" if near else f"known: {', '.join(known)}"


def _fits(value: object, kind: Any) -> bool:
    if get_origin(kind) in (Union, UnionType):
        return any(_fits(value, option) for option in get_args(kind))
    if get_origin(kind) is Literal:
        return value in get_args(kind)
    if get_origin(kind) is tuple:
        items = _item_kinds(kind, value)
        return items is not None and all(_fits(item, own) for item, own in zip(value, items, strict=True))  # type: ignore[call-overload]
    if kind is float:
        return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    if kind is int:
        return isinstance(value, int) and not isinstance(value, bool)
    return isinstance(value, kind)


def _item_kinds(kind: Any, value: object) -> list[Any] | None:
    """The kind of each item of a list that a tuple's annotation asks for; None where it is no such list."""
    if not isinstance(value, list):
        return None
    kinds = get_args(kind)
    if kinds[-1] is Ellipsis:
        return [kinds[0]] * len(value)
    return list(kinds) if len(kinds) == len(value) else None


def _converted(value: object, kind: Any) -> object:
    if isinstance(value, list):
        return tuple(_converted(v, k) for v, k in zip(value, _item_kinds(kind, value) or (), strict=True))
    wants_float = kind is float or float in get_args(kind)
    return float(value) if wants_float and isinstance(value, int) else value


def _described(kind: Any) -> str:
    if get_origin(kind) in (Union, UnionType):
        return " or ".join(_described(option) for option in get_args(kind) if option is not NoneType)
    if get_origin(kind) is Literal:
        return "one of " + ", ".join(_toml(choice) for choice in get_args(kind))
    if get_origin(kind) is tuple:
        kinds = get_args(kind)
        if kinds[-1] is Ellipsis:
            return f"a list, each {_described(kinds[0])}"
        return f"a list of {', '.join(_described(own) for own in kinds)}"
    return {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}[kind]


def _table(name: str, stage: Any) -> str:
    plain = [(f, getattr(stage, f.name)) for f in fields(stage)]
    return f"[{name}]\n" + "".join(_line(f, value) for f, value in plain if not is_dataclass(value))


def _line(described: Field, value: object) -> str:
    unit, why = described.metadata.get("unit", ""), described.metadata.get("why", "")
    comment = f"# {f'[{unit}] ' if unit else ''}{why}\n"
    return comment + (f"# {described.name} =\n" if value is None else f"{described.name} = {_toml(value)}\n")


def _toml(value: object) -> str:
    """A scalar or list as TOML writes it; strings and booleans look as in JSON."""
    if isinstance(value, tuple | list):
        return f"[{', '.join(_toml(item) for item in value)}]"
    return repr(value) if isinstance(value, float) else json.dumps(value, ensure_ascii=False, default=str)
