"""Weight per trial: what mass the plates carry, by the mean force less what the markers' rise asks for."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.common.gravity import GRAVITY
from solver.common.runs import runs
from solver.diagnosis.direct_checks.measured import Measured, may_hide
from solver.diagnosis.direct_checks.settings import DirectCheckSettings
from solver.diagnosis.direct_checks.statement import About, Statement, nats_of
from solver.diagnosis.direct_checks.weighings import LEAST_KG

DIRECT_CHECK = "weight"


@dataclass(frozen=True)
class Carried:
    """The mass that one trial's plates carry."""

    trial: str
    mass_kg: float
    std_kg: float  # by how the frames scatter


def carried_mass(trial: Measured) -> Carried | None:
    """Of the frames whose load is all on plates; None where there are too few."""
    return _carried(trial, trial.total_N, trial.borne)


def _carried(
    trial: Measured, vertical_N: Float[np.ndarray, " frames"], known: Bool[np.ndarray, " frames"]
) -> Carried | None:
    """Sum of the forces over that of g + a, which the motion's noise hardly biases.

    Nor does it scatter much: noise of positions, twice differentiated, cancels in a sum but for its ends, so
    that what is left of it falls with the time, not with its root.
    """
    seconds = float(known.sum() / trial.rate)
    if seconds < trial.settings.fewest_s:
        return None
    asked = GRAVITY + trial.acceleration[known]
    mass = carried_kg(vertical_N[known], asked, trial.settings)
    if mass is None:
        return None
    rest = vertical_N[known] - mass * asked
    independent = max(2.0, seconds / trial.settings.window_s)
    std = float(rest.std() / (independent * asked.mean()))
    return Carried(trial.capture.name, mass, std)


def carried_kg(
    vertical_N: Float[np.ndarray, " frames"],
    asked_m_per_s2: Float[np.ndarray, " frames"],
    settings: DirectCheckSettings,
) -> float | None:
    """What mass these forces carry; None where they are no weighing.

    They are none where they press upwards or hardly at all, or where the motion falls while they bear: then
    forces and motion are not of one time.

    Args:
        vertical_N: upward force.
        asked_m_per_s2: g and the upward acceleration, on the same frames.
        settings: of the direct checks.
    """
    asked = float(asked_m_per_s2.mean())
    mass = float(vertical_N.mean()) / asked if asked > settings.least_asked_share * GRAVITY else 0.0
    return mass if mass > LEAST_KG else None


def weight(trials: Sequence[Measured], entered_kg: float | None) -> list[Statement]:
    """Each trial against the mass that was entered, and trials against each other."""
    found = [carried for trial in trials if (carried := carried_mass(trial)) is not None]
    alone = [two for trial in trials if (two := _plates(trial)) is not None]
    entered = [_against_entered(one, entered_kg, trials[0].settings) for one in found if entered_kg]
    return [*entered, *_between(found, trials), *alone]


def _against_entered(one: Carried, entered_kg: float, settings: DirectCheckSettings) -> Statement:
    away = float(np.log(one.mass_kg / entered_kg))
    nats = nats_of(away, one.std_kg / one.mass_kg, settings.mass_scatter, settings.mass_usual)
    return Statement(
        DIRECT_CHECK,
        f"The plates carry {one.mass_kg:.1f} ± {one.std_kg:.1f} kg, and {entered_kg:.1f} kg were entered: "
        f"{100 * (one.mass_kg / entered_kg - 1):+.1f} % (normal: within 6 %).",
        {About.ENTERED_MASS: nats, About.LOAD: nats, About.PLATE_SCALE: nats},
        {"carried_kg": one.mass_kg, "carried_std_kg": one.std_kg, "entered_kg": entered_kg},
        trial=one.trial,
    )


def _between(found: Sequence[Carried], trials: Sequence[Measured]) -> list[Statement]:
    """The trial that stands off farthest from the others' middle, where there are two and more."""
    if len(found) < 2:
        return []
    settings = trials[0].settings
    said = []
    for one in found:
        others = [other for other in found if other is not one]
        usual = float(np.median([other.mass_kg for other in others]))
        away = float(np.log(one.mass_kg / usual))
        std = float(np.hypot(one.std_kg, np.median([o.std_kg for o in others])) / one.mass_kg)
        nats = nats_of(away, std, settings.trial_mass_scatter, settings.mass_usual)
        said.append(
            Statement(
                DIRECT_CHECK,
                f"The plates carry {one.mass_kg:.1f} kg here and {usual:.1f} kg in the other trials "
                "(normal: within 3 %).",
                {About.LOAD: nats},
                {"carried_kg": one.mass_kg, "others_kg": usual},
                trial=one.trial,
                against=tuple(other.trial for other in others),
            )
        )
    return [max(said, key=lambda t: t.loudest)]


def _plates(trial: Measured) -> Statement | None:
    """What each plate carries while it bears alone: of the plate that stands off farthest."""
    settings = trial.settings
    with np.errstate(invalid="ignore"):
        loaded = trial.vertical_N > settings.loaded_N
    edge = round(settings.edge_s * trial.rate)
    found = {}
    for k in range(loaded.shape[1]):
        alone = loaded[:, k] & (loaded.sum(axis=1) == 1) & np.isfinite(trial.total_N + trial.acceleration)
        for start, end in runs(alone):
            alone[start : start + edge * may_hide(trial, loaded, start - 1)] = False
            alone[max(start, end - edge * may_hide(trial, loaded, end)) : end] = False
        if alone.sum() / trial.rate >= settings.alone_s:
            mass = carried_kg(trial.vertical_N[alone, k], GRAVITY + trial.acceleration[alone], settings)
            if mass is not None:
                found[k] = mass
    if len(found) < 2:
        return None
    away = {k: np.log(mass / np.median([m for j, m in found.items() if j != k])) for k, mass in found.items()}
    k = min(found, key=lambda plate: float(away[plate]))  # the lighter of two: a plate that reads too little
    nats = nats_of(float(away[k]), 0.0, settings.plates_scatter, settings.exchange_usual)
    masses = ", ".join(f"{trial.capture.plates[j].name} {mass:.1f} kg" for j, mass in found.items())
    return Statement(
        DIRECT_CHECK,
        f"While one plate bears alone, it carries: {masses} (normal: within 8 % of each other).",
        {About.PLATE_SCALE: nats, About.PLATE_ZERO: nats, About.OFF_PLATE: nats},
        {f"plate_{j + 1}_kg": mass for j, mass in found.items()},
        trial=trial.capture.name,
        target="+".join(f"plate_{j + 1}" for j in found),
    )
