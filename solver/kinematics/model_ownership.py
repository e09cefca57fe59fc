"""Whose model it is: a generic one, to be scaled, or one that was scaled and registered for this person.

A registered model has its markers where the person wore them. So with the model as it is, what is left of the
markers' distances in their bodies' frames moves with the skin, about a place near zero; a generic model's
markers, or those of another person's model, stay centimetres off all along.
"""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.common.notes import Kind, Note, noted
from solver.common.one_thread import one_thread
from solver.kinematics.calibration import CalibrationFrames
from solver.kinematics.frame_solver import PoseProblem, solve_frames
from solver.kinematics.scale_prior import offset_std
from solver.kinematics.settings import CALIBRATION_ROBUST_SCALE_M, KinematicsSettings
from solver.skeleton.skeleton import Skeleton

# [m] median distance of a model's markers from their places, the model as it is, in the mean over frames: 0
# to 0.7 cm with six persons' own models, 1.9 to 5 cm with ten generic ones or others' own
REGISTERED_M = 0.012
REGISTERED_ODDS = 6.0  # [nats] for each factor of e nearer or farther: half or twice that distance is clear
SAME_MASS_ODDS = 1.0  # [nats] for a model that weighs what was entered: programs scale the mass as well
MODEL_NAME_ODDS = 1.0  # [nats] for a name with 'scaled' or 'generic': files are copied and renamed
# [m] of a kept model's markers: what the recording tells of places that a laboratory registered is mostly
# skin
REGISTERED_OFFSET_STD_M = 0.002
# [m] a kept model's marker that is so far off on every frame was put on elsewhere; where fewer than two
# stay on its segment it takes twice as much
REFUTED_M = 0.04

FEWEST_STAYING = 2  # markers that fix how a segment turns whatever becomes of another one
FEWEST_OWN = 8  # markers of the model's own; fewer do not tell whether it fits
SAME_MASS = 0.005  # relative: a model of a person weighs what was entered for them
STORED = "stored"  # said of the model inside a recording's own file
SCALED_WORDS = ("scaled",)
GENERIC_WORDS = ("generic", "unscaled")


@dataclass(frozen=True)
class Ownership:
    """Whether a model is this person's, and what follows for its markers."""

    is_scaled: bool
    refuted: tuple[str, ...] = ()  # markers of a kept model that sit elsewhere on most frames
    notes: tuple[Note, ...] = ()

    def offset_std(self, body: Skeleton, own: Collection[str]) -> Float[np.ndarray, " markers"] | None:
        """How far each marker may lie from the model's place for it [m]; None where it is to be scaled.

        Args:
            body: with the markers that the recordings share.
            own: names of the model's own markers; others were added at a landmark's usual place.
        """
        if not self.is_scaled:
            return None
        usual = offset_std(body.markers)
        kept = np.array([m.name in own and m.name not in self.refuted for m in body.markers])
        return np.where(kept, np.minimum(usual, REGISTERED_OFFSET_STD_M), usual)


@dataclass(frozen=True)
class AsItIs:
    """How the markers lie about the model as it came, in the mean over frames and about that mean [m]."""

    standing_m: Float[np.ndarray, " markers"]  # NaN where never seen
    own: Bool[np.ndarray, " markers"]

    @property
    def typical_m(self) -> float:
        """Median over the model's own markers; NaN where they are too few."""
        told = self.standing_m[self.own & np.isfinite(self.standing_m)]
        return float(np.median(told)) if len(told) >= FEWEST_OWN else float("nan")

    def refuted(self, bodies: Int[np.ndarray, " markers"], limit_m: float) -> Bool[np.ndarray, " markers"]:
        """The model's own markers that sit elsewhere, beyond what a partner of theirs may have caused.

        Two markers that tell how a segment turns share the error in the distance between them, and a robust
        fit puts it on either. Without one of them the segment turns about the other. So where fewer than
        two own markers would stay on the segment, it takes twice the limit.

        Args:
            bodies: of each marker.
            limit_m: beyond which a marker sits elsewhere.
        """
        seen = self.own & np.isfinite(self.standing_m)
        off = seen & (self.standing_m > limit_m)
        staying = np.array([np.sum(seen & ~off & (bodies == body)) for body in bodies])
        return off & ((staying >= FEWEST_STAYING) | (self.standing_m > 2 * limit_m))


def as_it_is(
    body: Skeleton, own: Collection[str], frames: CalibrationFrames, settings: KinematicsSettings
) -> AsItIs:
    """Lay the model as it is over the frames and look at its markers.

    Args:
        body: unscaled; its markers are those of the frames, in the same order.
        own: names of the model's own markers.
        frames: measured markers, with start poses.
        settings: of the kinematics.
    """
    assert frames.start_q is not None
    every = np.arange(len(frames.observed_ground))
    with one_thread():
        problem = PoseProblem(body, frames.observed_ground, settings, CALIBRATION_ROBUST_SCALE_M)
        q, _ = solve_frames(problem, frames.start_q, every)
    poses = problem.kinematics.poses(q)
    R_ground_body = poses.R_ground_body[:, problem.kinematics.marker_bodies]
    off_ground = frames.observed_ground - problem.kinematics.markers(poses)
    off_body = np.einsum("tmji,tmj->tmi", R_ground_body, off_ground)
    standing = np.full(len(body.markers), np.nan)
    seen = np.isfinite(off_body).all(axis=2)
    for m in np.flatnonzero(seen.any(axis=0)):
        standing[m] = np.linalg.norm(np.median(off_body[seen[:, m], m], axis=0))
    return AsItIs(standing, np.array([marker.name in own for marker in body.markers]))


def whose_model(
    model: Skeleton,
    body: Skeleton,
    frames: CalibrationFrames,
    settings: KinematicsSettings,
    *,
    file_name: str,
    mass_kg: float | None = None,
    said: str | None = None,
) -> Ownership:
    """Decide whether a model is generic or this person's own, and say why.

    A person's word wins. Else the markers' fit as they are weighs most; the mass and the names decide between
    fits that could be either.

    Args:
        model: as its file holds it.
        body: with markers for the recordings' labels, in the order of the frames.
        frames: measured markers, with start poses.
        settings: thresholds.
        file_name: of the model.
        mass_kg: entered for the person.
        said: "scaled" or "generic", in subject.toml, where it says anything; "stored" of the model in a .b3d
            file, whose scales were fitted to these very markers.
    """
    if said == "generic" or not settings.keep_scaled_models:
        return Ownership(False)
    own = frozenset(model.marker_names)
    found = as_it_is(body, own, frames, settings)
    typical = found.typical_m
    names = f"{model.name} {file_name}".lower()
    says_generic = any(word in names for word in GENERIC_WORDS)
    says_scaled = not says_generic and any(word in names for word in SCALED_WORDS)
    same_mass = mass_kg is not None and abs(model.mass / mass_kg - 1) < SAME_MASS
    measured = f"its markers lie {100 * typical:.1f} cm from their places on it in the median"
    if said is None:
        if not np.isfinite(typical):
            return Ownership(False)
        odds = REGISTERED_ODDS * float(np.log(REGISTERED_M / max(typical, 1e-4)))
        odds += (same_mass - (mass_kg is not None and not same_mass)) * SAME_MASS_ODDS
        odds += (says_scaled - says_generic) * MODEL_NAME_ODDS
        if odds < 0:
            return Ownership(False, notes=_of_another(file_name, measured, says_scaled, same_mass))
    if said == STORED:
        return _of_the_recording(file_name, measured, own, typical <= REGISTERED_M)
    bodies = np.array([marker.body for marker in body.markers])
    refuted = tuple(body.markers[m].name for m in np.flatnonzero(found.refuted(bodies, REFUTED_M)))
    why = [measured] if np.isfinite(typical) else []
    why += ["it weighs what was entered"] if same_mass else []
    why += ["its name says so"] if says_scaled else []
    why = ["subject.toml says so"] if said else why
    notes = [
        Note(
            Kind.PERSON,
            f"{file_name} is taken for this person's own scaled model ({', '.join(why)}): its scales and "
            'marker places are kept; model_is = "generic" in subject.toml scales it again',
        )
    ]
    if refuted:
        listed = ", ".join(
            f"{name} ({100 * found.standing_m[body.marker_names.index(name)]:.0f} cm)" for name in refuted
        )
        notes += noted(
            Kind.MODEL_AGAINST_MARKERS,
            f"of that model, these markers sit elsewhere on most frames and are placed again: {listed}",
        )
    if said and typical > REGISTERED_M:
        notes += noted(
            Kind.OTHER,
            f"subject.toml says that {file_name} is this person's scaled model, but {measured}: "
            "is it of another person, or were the markers put on again since?",
        )
    return Ownership(True, refuted, tuple(notes))


def _of_the_recording(file_name: str, measured: str, own: frozenset[str], is_near: bool) -> Ownership:
    """A model that was scaled to these markers; its markers stay, unless most of them sit elsewhere."""
    places = "are kept" if is_near else f"are fitted again, because {measured}"
    note = Note(
        Kind.OTHER,
        f"{file_name}: the scales of the model in it are kept, its markers' places {places}; "
        'model_is = "generic" in subject.toml scales it again, "default" uses the program\'s own body',
    )
    return Ownership(True, () if is_near else tuple(sorted(own)), (note,))


def _of_another(file_name: str, measured: str, says_scaled: bool, same_mass: bool) -> tuple[Note, ...]:
    """Said of a model that seems to be somebody's, but does not fit this person."""
    if not says_scaled and not same_mass:
        return ()
    why = " and ".join(["its name says so"] * says_scaled + ["it weighs what was entered"] * same_mass)
    return noted(
        Kind.MODEL_AGAINST_MARKERS,
        f"{file_name} seems to be a scaled model ({why}), but {measured}: of another person, or without "
        'registered markers? It is scaled and registered again; model_is = "scaled" in subject.toml keeps it',
    )
