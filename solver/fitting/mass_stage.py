"""The subject's mass that the trials agree on, and how much more each trial's plates read."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from solver.common.notes import Kind, Note, noted
from solver.dynamics.com_trajectory import MassEstimate, com_data
from solver.dynamics.inertia_parameters import inertia_parameters
from solver.dynamics.mass import mass_from_forces
from solver.dynamics.trajectory.trajectory_search import TrajectoryFit
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.fitting.fit_result import TrialFit
from solver.fitting.settings import Settings
from solver.fitting.state import FitState, MassAndGains
from solver.skeleton.scaling import with_mass
from solver.skeleton.skeleton import Skeleton

GAIN_STD = 0.03  # plates of one laboratory disagree by 1 to 5 % between trials and activities
NOTABLE_MASS = 0.03  # from which on a moved body mass is noted: three deviations of a scale's reading
NOTABLE_GAIN = 0.02  # from which on a trial's disagreement is noted
# from which on a segment's mass is noted: people scatter by 3 to 10 % about tables
NOTABLE_SEGMENT_MASS = 0.1
# from the middle of all trials' masses and the entered one: two deviations of a plate's gain. A trial
# beyond does not weigh the body: something else is on its plates
CONTRADICTING_MASS = 0.06


def weigh_body(state: FitState, settings: Settings) -> FitState:
    """Which trials have forces enough for the trajectory fit, and what their plates say of the body."""
    fitted: tuple[int, ...] = ()
    if settings.trajectory.enabled:
        fewest = settings.trajectory.fewest_frames
        fitted = tuple(i for i, fit in enumerate(state.trials) if fit.forces_known.sum() >= fewest)
    state = replace(state, fitted=fitted)
    if not fitted:
        return state
    own_std = settings.com.plate_gain_std  # where plates weighed the person
    if state.subject.mass_kg is not None:
        own_std = settings.trajectory.body_mass_std
    weighed = estimate_mass_and_gains(
        state.members, state.skeleton, settings, extended=state.extension is not None, own_std=own_std
    )
    return replace(state, weighed=weighed)


def estimate_mass_and_gains(
    fits: Sequence[TrialFit],
    skeleton: Skeleton,
    settings: Settings,
    *,
    extended: bool = False,
    own_std: float = 0.0,
) -> MassAndGains:
    """One body has one mass, and the fit follows every trial's forces in shape only.

    What a trial's plates read beyond that mass stays in its residual; else it would bend every motion, most
    of all where forces are missing, and make all segments heavier. A trial that contradicts the others and
    the entered mass does not weigh the body. The others move it no further than a scale's reading errs.

    Args:
        fits: with forces.
        skeleton: with the entered mass, or the one that forces or tables told.
        settings: of every stage.
        extended: something acts beside the recorded forces, which may be what the plates read too much: the
            mass stays, and one trial alone has nothing to differ from.
        own_std: relative, of the skeleton's mass.
    """
    weights, own_mass = settings.trajectory, skeleton.mass
    nothing = MassAndGains(own_mass, (1.0,) * len(fits), std_kg=own_std * own_mass)
    if extended and len(fits) < 2:
        return nothing
    trials = [com_data(skeleton, f.motion, f.contacts, f.mask) for f in fits if f.contacts and f.mask]
    estimates = [mass_from_forces([trial], settings.com) for trial in trials]
    agree = agreeing(estimates, own_mass, CONTRADICTING_MASS)
    taken = [trial for trial, kept in zip(trials, agree, strict=True) if kept]
    pooled = estimates[0] if len(trials) == 1 else mass_from_forces(taken, settings.com)
    if pooled is None:
        return nothing
    reference, std_kg = pooled.mass_kg, own_std * own_mass
    if not extended:
        trust = _trust(pooled, own_mass, weights)
        off = float(np.clip(trust * (pooled.mass_kg / own_mass - 1), -NOTABLE_MASS, NOTABLE_MASS))
        reference, std_kg = own_mass * (1 + off), float(np.hypot((1 - trust) * std_kg, trust * pooled.std_kg))
    gains, notes = [], list[Note]()
    against = "the other trials" if len(fits) > 1 else "the body's mass"
    for fit, own, kept in zip(fits, estimates, agree, strict=True):
        gain = 1.0
        if own is not None:
            trust = 1 / (1 + (own.sampling_std_kg / (GAIN_STD * reference)) ** 2)
            gain += trust * (own.mass_kg / reference - 1)
        gains.append(gain)
        if own is not None and not kept:
            text = (
                f"its forces correspond to {own.mass_kg:.1f} kg, those of the other trials to "
                f"{pooled.mass_kg:.1f} kg, so it is not used for the body's mass: does something stand on a "
                "plate, is a gain wrong, is something carried, or is it another person?"
            )
            notes.append(Note(Kind.FORCES_AGAINST_BODY, text, trial=fit.capture.name))
        elif abs(gain - 1) > NOTABLE_GAIN:
            text = f"plates read {100 * (gain - 1):+.1f} % compared with {against}"
            notes.append(Note(Kind.FORCES_AGAINST_BODY, text, trial=fit.capture.name))
    return MassAndGains(own_mass if extended else reference, tuple(gains), tuple(notes), std_kg)


def agreeing(estimates: Sequence[MassEstimate | None], own_mass: float, tolerance: float) -> list[bool]:
    """Which trials may weigh the body: all but those far from the middle of all, the own mass among them.

    Of two that differ nobody knows which is right; both stay.
    """
    votes = [estimate.mass_kg for estimate in estimates if estimate is not None]
    if len(votes) < 2:
        return [True] * len(estimates)
    middle = float(np.median([*votes, own_mass]))
    kept = [e is None or abs(e.mass_kg / middle - 1) <= tolerance for e in estimates]
    return (
        kept
        if any(e is not None and k for e, k in zip(estimates, kept, strict=True))
        else [True] * len(estimates)
    )


def _trust(pooled: MassEstimate, own_mass: float, weights: TrajectorySettings) -> float:
    """Share of the way to what the plates say that the body's mass goes, by how sure they are."""
    return 1 / (1 + (pooled.sampling_std_kg / (weights.body_mass_std * own_mass)) ** 2)


def mass_notes(nominal: Skeleton, fit: TrajectoryFit, settings: TrajectorySettings) -> tuple[Note, ...]:
    """What to say of the masses that a fit found.

    Args:
        nominal: with the mass that the forces were judged with.
        fit: of it.
        settings: from which changes on.
    """
    notes: tuple[Note, ...] = ()
    if abs(fit.skeleton.mass / nominal.mass - 1) > NOTABLE_MASS:
        notes = noted(
            Kind.OTHER,
            f"the fit moved the body's mass from {nominal.mass:.1f} to {fit.skeleton.mass:.1f} kg: is a "
            "force missing, the plates' gain off, something carried, or the entered mass wrong?",
        )
    return (*notes, *segment_mass_notes(with_mass(nominal, fit.skeleton.mass), fit, settings))


def segment_mass_notes(
    nominal: Skeleton, fit: TrajectoryFit, settings: TrajectorySettings
) -> tuple[Note, ...]:
    """A note that names segments and ratios where forces ask for more than people's scatter; else nothing.

    Args:
        nominal: scaled, that the fit's inertias are changes of.
        fit: of it.
        settings: from which ratio on.
    """
    if not settings.fit_inertias:
        return ()
    inertias = inertia_parameters(nominal)
    asked = inertias.pseudo_inertias(fit.asked_phi)[:, 3, 3]
    ratios = _ratios(nominal, asked)
    kept = _ratios(nominal, [body.mass for body in fit.skeleton.bodies])
    said = []
    for group in range(len(inertias.names)):
        bodies = np.flatnonzero(inertias.group == group)
        first = bodies[0]
        if max(abs(ratios[first] - 1), abs(kept[first] - 1)) <= NOTABLE_SEGMENT_MASS:
            continue
        names = " and ".join(nominal.bodies[b].name for b in bodies)
        said.append((abs(ratios[first] - 1), f"{names} {ratios[first]:.2f} (the fit has {kept[first]:.2f})"))
    if not said:
        return ()
    listed = ", ".join(text for _, text in sorted(said, reverse=True))
    return noted(
        Kind.MODEL_AGAINST_MARKERS,
        "the forces would fit better with other segment masses than the tables give, by the factors: "
        f"{listed}; do forces come late, is a plate turned or misplaced, is something carried, or is the "
        "body unlike the tables? Soft tissue has the same effect, above all in runs and landings",
    )


def _ratios(
    nominal: Skeleton, masses: Sequence[float] | Float[np.ndarray, " bodies"]
) -> Float[np.ndarray, " bodies"]:
    """To the nominal masses; 1 where a segment has none."""
    own = np.array([body.mass for body in nominal.bodies])
    return np.divide(np.asarray(masses), own, out=np.ones(len(own)), where=own > 0)
