"""Segment mass: some segments weigh otherwise than the model has them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.about import About, AtFault, Entry, Named, Size, Weight
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Signature
from solver.diagnosis.causes.pictures import Segments
from solver.diagnosis.causes.readings import Reading
from solver.diagnosis.causes.required_by_inertia import required_by_bodies
from solver.diagnosis.causes.scene import Scene
from solver.kinematics.scale_prior import scale_groups
from solver.skeleton.skeleton import Skeleton

LIGHTEST_SEGMENT_SHARE = 0.007  # of body mass, each of a group: a forearm's bone has it, a hand does not
LIGHTEST_SHARE = 0.03  # of the body's mass, a group together: a tenth more of less changes no joint torque
HEAVIEST_SHARE = 0.75  # of the body's mass; beyond, it is the subject's mass
PRIOR_STD = 0.15  # relative, beyond what tables scatter
LEAST = 0.06  # relative: what tables scatter
MOST = 1.65  # times or a 1.65th of what tables say; nobody is built otherwise
WHOLE_LIMBS = 4  # segments: upper and lower, left and right
WHOLE_LIMBS_ODDS = -9.0  # [nats] both legs or both arms rather than one segment
ONE_SIDED_ODDS = 2.0  # [nats] against one of a pair


ABOUT = About(
    id="segment_mass",
    entry=Entry("bodies", "true mass = factor × mass in the model", "`mass_factor`"),
    title="wrong segment mass: {target}",
    sentence="{target}: the masses of these segments differ from those in the model.",
    remedy=("Scale the segments' masses to the person: a scan, or tables for the person's build."),
    told_apart_by="a trial in which the segments swing fast, and the person on a scale",
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


@dataclass(frozen=True)
class SegmentMass(Candidate):
    """The mass and inertia of some segments times a factor; their centres of mass stay.

    η is the part of it that the other segments bear, in proportion to their masses: 0 where the person's mass
    grows with the segments', 1 where a scale told the person's mass and only its division is wrong. There is
    nothing in between, or the segments would explain a wrong mass of the whole person. With
    x = the segments' relative growth and s = their mass over that of the others, the others grow by −η s x.
    """

    about = ABOUT

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
        return Signature(-change[:, :, None], np.array([PRIOR_STD]))

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, "1"],
        covariance: Float[np.ndarray, "1 1"],
    ) -> dict[str, Estimate]:
        """mass_factor: the segments' growth over that of the others, which the entered total rescales."""
        borne = eta[0] * self._ratio(scenes[0].skeleton)
        growth, others = 1 + float(x[0]), 1 - borne * float(x[0])
        slope = (others + borne * growth) / others**2
        return {"mass_factor": Estimate(growth / others, abs(slope) * float(np.sqrt(covariance[0, 0])))}

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Beyond what people scatter around tables, and still a person's."""
        factor = estimates["mass_factor"].value
        return 1 / MOST < factor < MOST and abs(factor - 1) > LEAST

    def _bodies(self, skeleton: Skeleton) -> list[int] | None:
        names = self.target.split("+")
        return [skeleton.body_index(n) for n in names] if set(names) <= set(skeleton.body_names) else None

    def _ratio(self, skeleton: Skeleton) -> float:
        own = sum(skeleton.bodies[b].mass for b in self._bodies(skeleton) or [])
        return own / (skeleton.mass - own)


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """Each segment, each left and right pair, each pair with the one it hangs on; in the model's order."""
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
        SegmentMass("+".join(skeleton.body_names[b] for b in group), len(group) == 1 and group[0] in paired)
        for group, share in zip(groups, shares, strict=True)
        if LIGHTEST_SHARE <= share <= HEAVIEST_SHARE
    ]
