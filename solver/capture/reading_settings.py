"""What reading a trial's files obeys, part by part; each part is a table of settings.toml."""

from dataclasses import dataclass, field

from solver.capture.axes import AxesSettings
from solver.capture.clock import ClockSettings
from solver.capture.edge_zeros import EdgeZeroSettings
from solver.capture.force_platform import ForcePlatformSettings
from solver.capture.force_settings import ConditioningSettings, ForceTableSettings
from solver.capture.length_units import LengthUnitSettings
from solver.capture.marker_cleaning import MarkerCleaningSettings
from solver.capture.plate_sign_settings import PlateSignSettings
from solver.capture.platform_wrench import PlatformUnitSettings
from solver.capture.trajectory_joining import JoiningSettings
from solver.settings_field import setting


@dataclass(frozen=True)
class PairingSettings:
    """Whether markers and forces are in the same axes and belong together."""

    near_m: float = setting(
        0.5,
        unit="m",
        why="a foot's markers are within 0.2 m of its centre of pressure; this far off it isn't under it",
    )
    nearer_share: float = setting(
        0.5,
        unit="",
        why="of the distance in common axes: only so much nearer do axes of their own count as true",
    )
    judged_samples: int = setting(
        50, unit="samples", why="loaded ones of a plate, evenly spread, whose distance to markers is judged"
    )


@dataclass(frozen=True)
class ReadingSettings:
    """How files become markers and plates."""

    length_units: LengthUnitSettings = field(default_factory=LengthUnitSettings)
    clock: ClockSettings = field(default_factory=ClockSettings)
    axes: AxesSettings = field(default_factory=AxesSettings)
    cleaning: MarkerCleaningSettings = field(default_factory=MarkerCleaningSettings)
    joining: JoiningSettings = field(default_factory=JoiningSettings)
    force_tables: ForceTableSettings = field(default_factory=ForceTableSettings)
    platforms: ForcePlatformSettings = field(default_factory=ForcePlatformSettings)
    platform_units: PlatformUnitSettings = field(default_factory=PlatformUnitSettings)
    edge_zeros: EdgeZeroSettings = field(default_factory=EdgeZeroSettings)
    plate_signs: PlateSignSettings = field(default_factory=PlateSignSettings)
    pairing: PairingSettings = field(default_factory=PairingSettings)
    conditioning: ConditioningSettings = field(default_factory=ConditioningSettings)


READING = ReadingSettings()
