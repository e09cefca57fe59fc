"""What reading a trial's files obeys, part by part; each part is a table of settings.toml."""

import math
from dataclasses import dataclass, field

from solver.capture.axes import AxesSettings
from solver.capture.clock_settings import ClockSettings
from solver.capture.formats.length_units import LengthUnitSettings
from solver.capture.marker_cleaning import MarkerCleaningSettings
from solver.capture.plates.edge_zeros import EdgeZeroSettings
from solver.capture.plates.force_platform import ForcePlatformSettings
from solver.capture.plates.force_settings import ConditioningSettings, ForceTableSettings
from solver.capture.plates.loads_under_feet import UnderFeetSettings
from solver.capture.plates.plate_sign_settings import PlateSignSettings
from solver.capture.plates.platform_wrench import PlatformUnitSettings
from solver.capture.trajectory_joining import JoiningSettings
from solver.common.settings_field import setting


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
class ForceFileSettings:
    """Which force table is taken for the forces of which markers: log odds, base e, that add up."""

    named_alike: float = setting(
        4.0, unit="", why="55 to 1: files of a trial are named alike; now and then one lies in a wrong folder"
    )
    named_in_part: float = setting(1.0, unit="", why="walk_kine and walk_1_grf: a hint, no more")
    named_siblings: float = setting(
        -3.0, unit="", least=-math.inf, why="walk1 and walk2 are two trials, 20 to 1"
    )
    alone: float = setting(
        1.0, unit="", why="the only markers and the only forces without a partner, where contents agree"
    )
    same_span: float = setting(
        1.5, unit="", why="both begin and end together, as no other markers of the folder do"
    )
    span_frames: float = setting(
        1.5, unit="frames", why="of the markers, that beginnings and ends may differ by"
    )
    taken: float = setting(2.0, unit="", why="7 to 1 in all; a wrong pair is worse than a missing one")
    lead: float = setting(2.0, unit="", why="over the next possible pair, as above")
    least_overlap: float = setting(
        0.5, unit="", below=1.0, why="of the shorter of the two recordings; less is another moment"
    )
    apart: float = setting(
        0.1,
        unit="",
        below=1.0,
        why="two marker files that share less than this of the shorter are parts of one longer recording",
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
    under_feet: UnderFeetSettings = field(default_factory=UnderFeetSettings)
    force_files: ForceFileSettings = field(default_factory=ForceFileSettings)
    conditioning: ConditioningSettings = field(default_factory=ConditioningSettings)


READING = ReadingSettings()
