"""Every cause that the diagnosis knows, at every target of a subject's trials."""

from collections.abc import Sequence

from solver.diagnosis.causes.about import About, CorrectedBy
from solver.diagnosis.causes.belts import BeltAcceleration, BeltSlope
from solver.diagnosis.causes.body_masses import CarriedMass, SegmentMass, SubjectMass
from solver.diagnosis.causes.capture_scale import CaptureScale
from solver.diagnosis.causes.clocks import ClockOffset, PlateClock, SampleRate, TrialClocks
from solver.diagnosis.causes.effect import NO_PATHS, Candidate, Paths
from solver.diagnosis.causes.exchanged_forces import AxisConvention, PlateExchange, PlateSwap
from solver.diagnosis.causes.external_contact import ExternalContact
from solver.diagnosis.causes.filter_mismatch import FilterMismatch
from solver.diagnosis.causes.forces_on_trunk import BodyWeightSupport, Drag, ElasticTether
from solver.diagnosis.causes.marker_effect import MarkerFinding
from solver.diagnosis.causes.marker_slip import MarkerSlip
from solver.diagnosis.causes.marker_swap import MarkerSwap
from solver.diagnosis.causes.observed_trial import Scene
from solver.diagnosis.causes.off_plate_step import OffPlateStep
from solver.diagnosis.causes.plate_geometry import GravityTilt, PlatePosition, PlateYaw
from solver.diagnosis.causes.plate_readings import ObjectOnPlate, PlateBias, PlateGain, ZeroLevel
from solver.diagnosis.causes.rearranged_plate import PlateMirror, PlateTurn, PlateUnits
from solver.diagnosis.causes.segment_displaced import SegmentDisplaced
from solver.diagnosis.causes.soft_tissue import SoftTissue
from solver.diagnosis.causes.wobbling_mass import WobblingMass

CAUSES: tuple[type[Candidate], ...] = (
    ClockOffset,
    TrialClocks,
    PlateClock,
    SampleRate,
    FilterMismatch,
    PlateGain,
    PlateBias,
    ZeroLevel,
    PlatePosition,
    PlateYaw,
    PlateTurn,
    PlateMirror,
    PlateUnits,
    PlateSwap,
    PlateExchange,
    AxisConvention,
    GravityTilt,
    BeltSlope,
    ObjectOnPlate,
    OffPlateStep,
    ExternalContact,
    BodyWeightSupport,
    ElasticTether,
    Drag,
    BeltAcceleration,
    CarriedMass,
    SubjectMass,
    SegmentMass,
    WobblingMass,
    CaptureScale,
)
MARKER_CAUSES: tuple[type[MarkerFinding], ...] = (MarkerSlip, MarkerSwap, SegmentDisplaced, SoftTissue)
ABOUT: dict[str, About] = {
    about.id: about for about in (*(c.about for c in CAUSES), *(c.about for c in MARKER_CAUSES))
}
IDS = tuple(id for id, about in ABOUT.items() if not about.in_markers)
MARKER_IDS = tuple(id for id, about in ABOUT.items() if about.in_markers)


def catalogue(scenes: Sequence[Scene], paths: Paths = NO_PATHS) -> list[Candidate]:
    """Candidates on the wrench balance; causes that markers show are found before (`MARKER_IDS`).

    Args:
        scenes: of the subject's trials.
        paths: what each plate's path of pressure says of its turns.
    """
    return [cause.with_evidence(paths) for kind in CAUSES for cause in kind.candidates(scenes)]


def cannot_be_accepted(id: str) -> bool:
    """Whether a cause lies in the markers and no fit can correct it."""
    return id in ABOUT and ABOUT[id].corrected_by in (CorrectedBy.FILES, CorrectedBy.NOTHING)
