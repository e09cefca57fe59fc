"""Which segments lie between others: where people are touched and carry something less often."""

from solver.diagnosis.causes.force_on_body import trunk_bodies
from solver.skeleton.skeleton import Skeleton

BETWEEN_OTHERS_ODDS = 2.0  # [nats] against a touch or a load there rather than at hands, seat, thighs or back


def inner_segments(skeleton: Skeleton) -> frozenset[int]:
    """Segments between two others, but for trunk and thighs: upper arms, forearms, shanks, ankle bones."""
    parents = [joint.parent for joint in skeleton.joints]
    roots = {b for b, parent in enumerate(parents) if parent < 0}
    trunk = roots | {skeleton.body_index(name) for name in trunk_bodies(skeleton)}
    between = {b for b, parent in enumerate(parents) if b in parents and parent not in roots}
    return frozenset(between - trunk)


def inner_arm_segments(skeleton: Skeleton) -> frozenset[int]:
    """Those of limbs that hang from the trunk's upper end: upper arms and forearms."""
    parents = [joint.parent for joint in skeleton.joints]
    upper = {skeleton.body_index(name) for name in trunk_bodies(skeleton)}
    upper = {b for b in upper if parents[b] >= 0}

    def hangs_from_it(body: int) -> bool:
        return parents[body] in upper or (parents[body] >= 0 and hangs_from_it(parents[body]))

    return frozenset(b for b in inner_segments(skeleton) if hangs_from_it(b))
