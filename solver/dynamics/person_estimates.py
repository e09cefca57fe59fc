"""Mass, height and sex where nobody entered them: from the forces, the scaled body, and tables."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from solver.capture.capture import Subject
from solver.common.notes import Kind, Note, noted
from solver.dynamics.com_settings import ComSettings
from solver.dynamics.com_trajectory import DISAGREEMENT, MassEstimate, Standing, disagreement
from solver.dynamics.mass import pool_masses
from solver.kinematics.scale_prior import stature, stature_of_trunk
from solver.skeleton.skeleton import Skeleton

# Mean and standard deviation of stature [m], and mean mass [kg]: Gordon et al., 1988 Anthropometric Survey of
# US Army Personnel (Natick/TR-89/044).
_STATURE = {"male": (1.756, 0.067), "female": (1.629, 0.064)}
_MASS = {"male": 78.5, "female": 62.0}
# Body-mass index [kg/m²] of children of 4 to 9 years, and up to which stature [m]: medians of the CDC growth
# charts (Kuczmarski et al. 2002) rise from there to those of grown-ups.
_CHILDRENS_INDEX, _CHILDRENS_STATURE, _GROWN_UP_STATURE = 16.0, 1.30, 1.65
_INDEX_SPREAD = 0.15  # of grown-ups; soldiers vary by 0.12
_BETWEEN_SPREAD = 0.20  # where a stature may be a child's or a grown-up's
_LEAST_SHARE, _MOST_SHARE = 0.55, 1.8  # of the usual mass: an index of 13 to 44 kg/m² of grown-ups
HIP_HEIGHT = 0.530  # over stature (Drillis & Contini 1966)
STATURE_STD_M = 0.05  # of a stature from legs and trunk: 4 cm of eleven people, 6 from their legs alone
_LIKELY_SEX_PROBABILITY = 0.9  # a sex less probable than this is not called likely


class PersonMass(NamedTuple):
    """What the body weighs, and what to say of it."""

    kg: float
    notes: tuple[Note, ...] = ()
    guessed_within: float | None = None  # standard deviation over it where nothing weighed the person


@dataclass(frozen=True)
class Plates:
    """What forces say of the mass."""

    estimate: MassEstimate | None = None  # by the trials' frames that count
    standing: tuple[Standing, ...] = ()  # by somebody still; who weighs as no person does is none
    read_something: bool = False


def person_mass(
    subject: Subject, skeleton: Skeleton, height_m: float, plates: Plates, settings: ComSettings
) -> PersonMass:
    """The entered mass, else what a standing person weighs, else what forces of trials tell, else tables.

    Args:
        subject: what was entered.
        skeleton: scaled; of a model that the subject brought, its own mass stands where nothing weighs.
        height_m: as `person_height` found it.
        plates: what they tell.
        settings: how far the entered mass and the forces may differ.
    """
    beside = _leaning(plates.estimate)
    if subject.mass_kg is not None:
        warning = plates.estimate and disagreement(plates.estimate, subject.mass_kg, settings)
        entered_kg = subject.mass_kg / (subject.scale_factor or 1.0)
        if abs(subject.mass_kg - entered_kg) > DISAGREEMENT * settings.entered_mass_std_kg:
            beside += noted(
                Kind.ENTERED_MASS,
                f"a scale says {subject.mass_kg:.1f} kg, which counts, and {entered_kg:.1f} kg were entered: "
                "is mass_kg wrong, or is something worn or carried in the trials?",
            )
        return PersonMass(subject.mass_kg, (*([warning] if warning else ()), *beside))
    standing = [one for one in plates.standing if _is_a_persons(one.mass.mass_kg, height_m, subject)]
    if standing:
        weight = pool_masses([one.mass for one in standing], settings)
        what = f"{weight.mass_kg:.1f} ± {2 * weight.std_kg:.1f} kg stand still"
        where = ", ".join(one.name for one in standing)
        return PersonMass(weight.mass_kg, (Note(Kind.PERSON, f"mass not given; {what} on {where}"), *beside))
    if plates.estimate is not None:
        mass = plates.estimate.mass_kg
        notes = (
            Note(
                Kind.PERSON,
                f"mass not given; {mass:.1f} ± {2 * plates.estimate.std_kg:.1f} kg estimated from the forces",
            ),
            *beside,
        )
        if not _is_a_persons(mass, height_m, subject):
            notes += (_hardly_a_persons(mass, height_m, subject),)
        return PersonMass(mass, notes)
    why, kind = "and no forces to estimate it from", Kind.GUESS
    if plates.read_something:
        why = "and the recorded forces do not tell it, as none counts that carries the body"
    if subject.model is not None:
        what = f"the model's own {skeleton.mass:.1f} kg is used"
        return PersonMass(skeleton.mass, noted(kind, f"mass not given, {why}; {what}"), _INDEX_SPREAD)
    if math.isnan(height_m):
        return PersonMass(
            skeleton.mass, noted(kind, f"mass not given, {why}, nor a height: it is unknown"), math.inf
        )
    mass, std = mass_of_height(height_m, subject.sex)
    if subject.height_m is None:
        std = math.hypot(std, 2 * mass * STATURE_STD_M / height_m)
    what = f"people of {height_m:.2f} m weigh {mass:.0f} ± {2 * std:.0f} kg; torques are as uncertain"
    return PersonMass(mass, noted(kind, f"mass not given, {why}; {what}"), std / mass)


def _leaning(estimate: MassEstimate | None) -> tuple[Note, ...]:
    if estimate is None or not estimate.lean_deg:
        return ()
    return noted(
        Kind.FORCES_AGAINST_BODY,
        f"the forces lean {estimate.lean_deg:.0f}° on average although nobody is accelerated, so they weigh "
        "along their own direction: does the belt slope, and are forces given in its axes? `diagnose` tells",
    )


def _is_a_persons(mass_kg: float, height_m: float, subject: Subject) -> bool:
    """Whether somebody of that height may weigh so much."""
    if math.isnan(height_m):
        return True
    return _LEAST_SHARE < mass_kg / mass_of_height(height_m, subject.sex)[0] < _MOST_SHARE


def _hardly_a_persons(mass_kg: float, height_m: float, subject: Subject) -> Note:
    """Said of forces that ask for more or less than anybody of that height weighs."""
    usual_kg, _ = mass_of_height(height_m, subject.sex)
    return Note(
        Kind.FORCES_AGAINST_BODY,
        f"the forces ask for a body of {mass_kg:.0f} kg, and people of {height_m:.2f} m weigh about "
        f"{usual_kg:.0f} kg: do plates hold more than this person's forces, in other units, or was one tared "
        "under a load? Do not use any torque before that is known; enter mass_kg",
    )


def person_height(
    subject: Subject, skeleton: Skeleton, legs_are_seen: bool = True
) -> tuple[float, tuple[Note, ...]]:
    """The entered height, else the scaled body's [m], NaN where nothing tells it; and what to say."""
    if subject.height_m is not None:
        return subject.height_m, ()
    height = _height_of_body(subject, skeleton) if legs_are_seen else None
    if height is None:
        return math.nan, noted(Kind.PERSON, "height not given, and no leg is seen to estimate it from")
    of = "legs and trunk" if subject.model is None else "legs"
    spread = f"{height:.2f} ± {2 * STATURE_STD_M:.2f} m"
    return height, noted(Kind.PERSON, f"height not given; {spread} from the scaled model's {of}")


def _height_of_body(subject: Subject, skeleton: Skeleton) -> float | None:
    """Standing height of the scaled body [m]; trunks of other models are no measure of anybody."""
    legs, trunk = stature(skeleton), stature_of_trunk(skeleton)
    if legs is None or trunk is None or subject.model is not None:
        return legs
    return HIP_HEIGHT * legs + (1 - HIP_HEIGHT) * trunk


def person_sex(subject: Subject, height_m: float) -> tuple[Note, ...]:
    """What to say of a sex that nobody entered, where the body was made from tables that have one.

    Args:
        subject: what was entered.
        height_m: entered or estimated; NaN where unknown.
    """
    if subject.sex is not None or subject.model is not None or not math.isfinite(height_m):
        return ()
    used = "masses of the segments are the mean of both sexes' tables"
    age = math.inf if subject.age_years is None else subject.age_years
    if height_m < _CHILDRENS_STATURE or (height_m < _GROWN_UP_STATURE and age < 16):
        return noted(Kind.PERSON, f"sex not given, and a child's height does not show it; {used}")
    male = probability_male(height_m, 0.0 if subject.height_m is not None else STATURE_STD_M)
    likely, p = ("male", male) if male > 0.5 else ("female", 1 - male)
    if p < _LIKELY_SEX_PROBABILITY:
        return noted(
            Kind.PERSON, f"sex not given, and the height does not show it ({likely}: {100 * p:.0f} %); {used}"
        )
    return noted(
        Kind.PERSON, f"sex not given; {likely} with a probability of {100 * p:.0f} %, by the height; {used}"
    )


def mass_of_height(height_m: float, sex: str | None) -> tuple[float, float]:
    """Mean mass of people of this height and its standard deviation [kg]."""
    sexes = ("male", "female") if sex is None else (sex,)
    grown_up = sum(_MASS[s] / _STATURE[s][0] ** 2 for s in sexes) / len(sexes)
    grown = (height_m - _CHILDRENS_STATURE) / (_GROWN_UP_STATURE - _CHILDRENS_STATURE)
    grown = min(1.0, max(0.0, grown))
    mass = (_CHILDRENS_INDEX + grown * (grown_up - _CHILDRENS_INDEX)) * height_m**2
    return mass, mass * (_BETWEEN_SPREAD if 0 < grown < 1 else _INDEX_SPREAD)


def probability_male(height_m: float, height_std_m: float) -> float:
    """Of a grown-up, as many men as women being recorded.

    Args:
        height_m: the person's.
        height_std_m: how uncertain that is.
    """
    log = {
        sex: -0.5 * ((height_m - mean) / math.hypot(std, height_std_m)) ** 2
        - math.log(math.hypot(std, height_std_m))
        for sex, (mean, std) in _STATURE.items()
    }
    return 1 / (1 + math.exp(log["female"] - log["male"]))
