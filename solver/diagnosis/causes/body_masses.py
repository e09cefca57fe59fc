"""Masses that are not those of the model: the whole body's, a segment's, or a load that is carried."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.about import (
    NOT_SHOWN,
    ON_SEGMENT,
    About,
    AtFault,
    Ball,
    Entry,
    Named,
    Place,
    Reading,
    Segments,
    Size,
    Weight,
)
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Fitted, InTrials, Signature, all_and_each
from solver.diagnosis.causes.observed_trial import Scene
from solver.diagnosis.causes.on_segments import (
    BETWEEN_OTHERS_ODDS,
    inner_arm_segments,
    required_by_bodies,
    required_by_changes,
)
from solver.diagnosis.causes.plate_readings import WEIGHT_STDS
from solver.kinematics.scale_prior import scale_groups
from solver.skeleton.skeleton import Skeleton

WHOLE_STD = 0.12  # relative: clothes and what people say they weigh, some percent; another adult's mass, 20
LIGHTEST_SEGMENT_SHARE = 0.007  # of body mass, each of a group: a forearm's bone has it, a hand does not
LIGHTEST_GROUP_SHARE = 0.03  # of body mass, together: a tenth more of less changes no joint torque
HEAVIEST_SHARE = 0.75  # of the body's mass; beyond, it is the subject's mass
SEGMENT_STD = 0.15  # relative, beyond what tables scatter
LEAST_SEGMENT = 0.06  # relative: what tables scatter
MOST_SEGMENT = 1.65  # times or a 1.65th of what tables say; nobody is built otherwise
WHOLE_LIMBS = 4  # segments: upper and lower, left and right
WHOLE_LIMBS_ODDS = -9.0  # [nats] both legs or both arms rather than one segment
ONE_SIDED_ODDS = 2.0  # [nats] against one of a pair
LIGHTEST_SHARE = 0.004  # of body mass: what lighter ones carry (toes), their neighbours carry as well
LOAD_KG = 4.0  # a rucksack, a measuring unit, ankle weights
LOAD_REACH_M = 0.12  # from the segment's centre of mass to the load's
SPREAD_M = 0.12  # of the load itself, and of its place, as radius of gyration
LEAST_LOAD_KG = 0.5  # shoes and clothes
FARTHEST_M = 0.8  # from the segment's origin: whatever is carried, lies on the body
MOMENTS = ((0, 3), (1, 3), (2, 3), (0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # entries of J


@dataclass(frozen=True)
class SubjectMass(Candidate):
    """All segments' inertias times mass_factor: mass_factor × required force is what the ground really gave.

    The force is exact at any size: true − recorded demand = −x × required with x = mass_factor − 1. Of the
    moments about the centre of mass nothing is claimed, although they grow likewise. They are the change of
    the body's spin, some N·m, much of it soft tissue and a generic model; a factor below 1 reduces it.
    In all of 13 sound real recordings their own factor is below 1, by 0.2 to 0.7 and up to 8 standard
    deviations, while weight gives 0.97 to 1.03: they would speak for a lighter body in each of them.
    """

    about = About(
        id="subject_mass",
        entry=Entry("`all`", "true mass = factor × entered mass", "`mass_factor`"),
        title="wrong body mass",
        sentence="The person's mass differs from the entered one.",
        remedy="Weigh the person with everything they wear, and enter that mass.",
        separate_by="the person on a scale, or a known weight on each plate",
        branch="body/whole mass",
        at_fault=AtFault.MODEL,
        weight=Weight.MASS,
        less_at_first=4.0,  # in 150 clean recordings it gains 0.4 at most
        asked_up_to=20.0,
        sizes=(
            Size(
                "mass_factor", 0.015, 0.08, 0.35, "scales, clothes, shoes; beyond 0.08 it is another person's"
            ),
        ),
        readings=(
            Reading(
                "mass_factor",
                "the person is {amount} {which} than entered",
                "%",
                1e2,
                zero=1.0,
                which=("heavier", "lighter"),
            ),
        ),
    )

    no_effect = 1.0
    least = 0.015  # what a scale, a meal and shoes make
    most = 0.35  # other adults; beyond, forces are missing, or are given in other units

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """The force that the whole body demands, at its centre of mass, with its sign turned."""
        return Signature(-scene.required_at_com_ground[:, :, None], np.array([WHOLE_STD]))

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """mass_factor, dimensionless."""
        growth = fit.estimate(0)
        return {"mass_factor": Estimate(1 + growth.value, growth.std)}

    def is_possible(self, estimates: dict[str, Estimate]) -> bool:
        """Of an adult."""
        return self.size(estimates) < self.most

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """One person, if anybody entered what they weigh."""
        return [cls("all")] if any(scene.mass_was_entered for scene in scenes) else []


@dataclass(frozen=True)
class SegmentMass(Candidate):
    """The mass and inertia of some segments times a factor; their centres of mass stay.

    η is the part of it that the other segments bear, in proportion to their masses: 0 where the person's mass
    grows with the segments', 1 where the person's mass is right and only its division is wrong. There is
    nothing in between, or the segments would explain a wrong mass of the whole person. With
    x = the segments' relative growth and s = their mass over that of the others, the others grow by −η s x.
    """

    about = About(
        id="segment_mass",
        entry=Entry("bodies", "true mass = factor × mass in the model", "`mass_factor`"),
        title="wrong segment mass: {target}",
        sentence="{target}: the masses of these segments differ from those in the model.",
        remedy=("Scale the segments' masses to the person: a scan, or tables for the person's build."),
        separate_by="a trial in which the segments swing fast, and the person on a scale",
        branch="body/one segment",
        names=Named.BODIES,
        at_fault=AtFault.MODEL,
        weight=Weight.MASS,
        odds_against=10.0,
        sizes=(Size("mass_factor", 0.06, 0.20, 0.40, "what tables of segments scatter"),),
        readings=(
            Reading(
                "mass_factor",
                "{amount} {which} than in the model",
                "%",
                1e2,
                zero=1.0,
                which=("heavier", "lighter"),
            ),
        ),
        picture=Segments(),
    )

    one_sided: bool = False  # one of a left and right pair

    @property
    def place_odds(self) -> float:
        """Builds differ by whole limbs; and alike on both sides: what one of them weighs more is carried."""
        whole = len(self.target.split("+")) == WHOLE_LIMBS  # a pair and the one it hangs on
        return WHOLE_LIMBS_ODDS * whole + ONE_SIDED_ODDS * self.one_sided

    def starts(self, scenes: Sequence[Scene]) -> tuple[Eta, ...]:
        """Person's mass right, and person's mass wrong likewise."""
        return ((1.0,), (0.0,))

    def admissible(self, eta: Eta) -> bool:
        """Between none and all."""
        return 0.0 <= eta[0] <= 1.0

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """What the segments demand less what is taken from the others, with its sign turned."""
        bodies = self._bodies(scene.skeleton)
        if bodies is None:
            return None
        own = required_by_bodies(scene, bodies)
        borne = eta[0] * self._ratio(scene.skeleton)
        change = own - borne * (scene.required_ground - own)
        return Signature(-change[:, :, None], np.array([SEGMENT_STD]))

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """mass_factor: the segments' growth over that of the others, which the entered total rescales."""
        borne = fit.eta[0] * self._ratio(scenes[0].skeleton)
        growth, others = 1 + float(fit.x[0]), 1 - borne * float(fit.x[0])
        slope = (others + borne * growth) / others**2
        return {"mass_factor": Estimate(growth / others, abs(slope) * float(np.sqrt(fit.covariance[0, 0])))}

    def is_possible(self, estimates: dict[str, Estimate]) -> bool:
        """Still a person's."""
        return 1 / MOST_SEGMENT < estimates["mass_factor"].value < MOST_SEGMENT

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Beyond what people scatter around tables."""
        return self.is_possible(estimates) and abs(estimates["mass_factor"].value - 1) > LEAST_SEGMENT

    def _bodies(self, skeleton: Skeleton) -> list[int] | None:
        names = self.target.split("+")
        return [skeleton.body_index(n) for n in names] if set(names) <= set(skeleton.body_names) else None

    def _ratio(self, skeleton: Skeleton) -> float:
        own = sum(skeleton.bodies[b].mass for b in self._bodies(skeleton) or [])
        return own / (skeleton.mass - own)

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """Each segment, each left and right pair, each pair with the one it hangs on."""
        if not scenes:
            return []
        skeleton = scenes[0].skeleton
        heavy = skeleton.bodies_from_share(LIGHTEST_SEGMENT_SHARE)
        counterparts = scale_groups(skeleton).group
        groups: list[tuple[int, ...]] = [(b,) for b in heavy]
        paired = {b for b in heavy if counterparts.tolist().count(counterparts[b]) == 2}
        for group in dict.fromkeys(counterparts.tolist()):
            pair = np.flatnonzero(counterparts == group).tolist()
            if len(pair) == 2 and set(pair) <= set(heavy):
                groups.append(tuple(pair))
                carriers = [skeleton.joints[b].parent for b in pair]
                if len(set(carriers)) == 2 and set(carriers) <= set(heavy):
                    groups.append(tuple(sorted({*pair, *carriers})))
        shares = [sum(skeleton.bodies[b].mass for b in g) / skeleton.mass for g in groups]
        return [
            cls("+".join(skeleton.body_names[b] for b in group), len(group) == 1 and group[0] in paired)
            for group, share in zip(groups, shares, strict=True)
            if LIGHTEST_GROUP_SHARE <= share <= HEAVIEST_SHARE
        ]


@dataclass(frozen=True)
class CarriedMass(InTrials):
    """A rigid load of mass m at r in the body's frame: more is required, so the signature is −Δrequired.

    With r₀ the segment's own centre of mass the load's pseudo-inertia is linear in m, m(r − r₀) and the six
    second moments about r₀. All ten are columns, so nothing is lost for a load far from r₀ or a wide one.
    η is 1 where the entered mass has the load in it: the body is as much lighter.
    """

    about = About(
        id="carried_mass",
        entry=Entry(
            "body",
            "a load that the model lacks, its centre in the body's frame",
            "`mass_kg`, `offset_x_m`, `offset_y_m`, `offset_z_m`",
        ),
        title="a load that is not in the model: {target}",
        sentence="A load that is not in the model is carried on {target}.",
        remedy=(
            "Weigh the load and note where it was fixed. Accept the cause for these trials or make the "
            "load part of the model, not both."
        ),
        separate_by="the person on a scale, with and without the load",
        branch="on the person/load",
        names=Named.BODIES,
        at_fault=AtFault.MODEL,
        weight=Weight.MASS,
        odds_against=6.0,
        sizes=(Size("mass_kg", 3.0, 20.0, 50.0, "on the trunk; 5 kg in a hand, 3 kg on a foot at most"),),
        readings=(
            Reading("mass_kg", "it weighs {amount}", "kg"),
            Place(
                "offset_{}_m",
                f"its centre lies {ON_SEGMENT}",
                "mm",
                1e3,
                f"where on the segment it lies, {NOT_SHOWN}",
            ),
        ),
        picture=Ball("mass_kg", "offset_{}_m"),
    )

    between_others: bool = False  # upper arm or forearm

    @property
    def place_odds(self) -> float:
        """Hands hold, trunk, legs and feet have weights strapped to them; arms hardly ever."""
        return BETWEEN_OTHERS_ODDS if self.between_others else 0.0

    def starts(self, scenes: Sequence[Scene]) -> tuple[Eta, ...]:
        """Without the load, and, of what was worn on a scale, with it: people enter what a scale says."""
        return ((),) if self.trial is not None or scenes[0].scale_factor is None else ((0.0,), (1.0,))

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Mass, three first moments and six second moments about the segment's centre of mass."""
        if self.target not in scene.skeleton.body_names or self.trial not in (None, scene.name):
            return None
        body = scene.skeleton.body_index(self.target)
        changes = load_basis(scene.skeleton.bodies[body].com_body)
        second = LOAD_KG * SPREAD_M**2
        prior_std = np.concatenate([[LOAD_KG], np.full(3, LOAD_KG * LOAD_REACH_M), np.full(6, second)])
        columns = -required_by_changes(scene, body, changes)
        if any(eta):
            columns[:, :, 0] += scene.required_at_com_ground / scene.skeleton.mass
        return Signature(columns, prior_std)

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """mass_kg, and the load's centre in the body's frame by division."""
        skeleton = scenes[0].skeleton
        com = skeleton.bodies[skeleton.body_index(self.target)].com_body
        found = {"mass_kg": fit.estimate(0)}
        for i, axis in enumerate("xyz"):
            away = fit.ratio(1 + i)
            found[f"offset_{axis}_m"] = Estimate(float(com[i]) + away.value, away.std)
        return found

    def is_possible(self, estimates: dict[str, Estimate]) -> bool:
        """A load is never negative, and on the body."""
        away = float(np.hypot.reduce([estimates[f"offset_{axis}_m"].value for axis in "xyz"]))
        return estimates["mass_kg"].value > 0 and away < FARTHEST_M

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Heavier than shoes, and a weight, not just a moment."""
        mass = estimates["mass_kg"]
        return self.is_possible(estimates) and mass.value > max(LEAST_LOAD_KG, WEIGHT_STDS * mass.std)

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """On each body that weighs something: in all trials, and in each alone where there are several.

        Of somebody whom nobody weighed, what is carried all the time is not told from build.
        """
        if not scenes:
            return []
        skeleton = scenes[0].skeleton
        entered = any(scene.mass_was_entered for scene in scenes)
        stretches = [t for t in all_and_each(scenes) if entered or t is not None]
        inner = inner_arm_segments(skeleton)
        return [
            cls(skeleton.body_names[b], trial, b in inner)
            for trial in stretches
            for b in skeleton.bodies_from_share(LIGHTEST_SHARE)
        ]


def load_basis(centre_body: Float[np.ndarray, "3"]) -> Float[np.ndarray, "10 4 4"]:
    """Pseudo-inertias by mass, first and second moments (xx yy zz xy xz yz) about a point [m]."""
    shift = np.eye(4)
    shift[:3, 3] = centre_body
    basis = np.zeros((10, 4, 4))
    basis[0, 3, 3] = 1.0
    for k, (i, j) in enumerate(MOMENTS, start=1):
        basis[k, i, j] = basis[k, j, i] = 1.0
    return shift @ basis @ shift.T
