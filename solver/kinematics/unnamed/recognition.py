"""Unnamed markers found on the default body, each with how sure that is; what stays ambiguous is said."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.capture.capture import Markers
from solver.common.one_thread import one_thread
from solver.kinematics.settings import KinematicsSettings
from solver.kinematics.unnamed.landmark_mixture import BodyShape, LandmarkMixture, by_shape, landmark_mixture
from solver.kinematics.unnamed.neighbours import weighed_against_neighbours
from solver.kinematics.unnamed.settings import FEWEST_MARKERS, NAMING
from solver.kinematics.unnamed.single_frame import lay_over
from solver.kinematics.unnamed.whole_recording import Followed, Seen, follow, forwards, with_segments_scaled
from solver.markers.atlas import Landmark
from solver.markers.understanding import LEAST

HEIGHT_M = 1.70  # [m] mean stature of people
HEIGHT_SCATTER = 0.09  # of the logarithm of people's stature
REFERENCE_SHARES = (1.0, 0.7, 0.3)  # frames by how upright they are: these start the search
GUESSES = 5  # different ones that are tried on the whole recording
DIFFER_SHARE = 0.1  # of the markers, on other bodies: then two guesses are different
FRAMES = 24  # of the recordings together: more change no answer
WELL_SEEN = 0.8  # of the most markers that any frame shows
RIVALS = 3  # guesses that are scaled and compared at the end
TEMPER = 5.0  # [nats] of the comparison: markers of one body are not independent evidence
EXAMINED_LIKELIHOOD_SHARE = 0.25  # solutions less likely than this are not examined so closely
SURE_LANDMARK = 0.6  # of the marker's share on its body: then it is called by the landmark
PLACE_STD_M = 0.03  # [m] of a place that was measured, not read from the atlas
FEWEST_BODIES = 5  # with a sure marker; fewer are no person
SURE_SHARE = 0.7  # of the markers that must find a body, or it is none

MOST_FRAMES = 400  # frames of all recordings together that references and frames are chosen from
FEWEST_POINTS = 6  # in a frame that starts the search


@dataclass(frozen=True)
class FoundMarker:
    """Where a marker without a name was found."""

    label: str
    landmark: Landmark | None  # that it is at, if one is likely enough; else it is somewhere on the body
    body: str
    place_body: Float[np.ndarray, "3"]  # [m] on the default body of default size
    spread_m: float
    confidence: float  # that it is on the body
    alternatives: tuple[tuple[str, float], ...]  # other bodies


@dataclass(frozen=True)
class Recognition:
    """All markers of a subject's recordings, looked at together."""

    markers: tuple[FoundMarker, ...]
    size: float  # of the person against the default body
    person: bool  # whether the cloud is one at all

    def by_label(self) -> dict[str, FoundMarker]:
        """Each label's marker."""
        return {found.label: found for found in self.markers}


def recognise(
    recordings: Sequence[Markers],
    known: Mapping[str, str],
    *,
    search: bool = True,
    settings: KinematicsSettings = NAMING,
) -> Recognition | None:
    """Find the markers on the default body.

    The body is laid over single frames in every heading, posture and size that a person may have. The best
    few understandings are followed over the recordings, where markers must keep their place on their body,
    and compared once the segments have their own lengths. Up is given by the ground; front and back, left
    and right follow from how a body is built and bends, and from where it walks.

    Args:
        recordings: of one person; a label means the same marker in all of them.
        known: landmarks of the labels whose names are understood.
        search: False where the known ones tell the pose, so that no frame need be searched.
        settings: of the search.

    Returns:
        None where there is nothing to look at.
    """
    with one_thread():
        cloud = _cloud(recordings)
        if cloud is None:
            return None
        mixture = landmark_mixture(settings)
        allowed = _allowed(cloud.labels, known, mixture)
        prior = (float(np.log(HEIGHT_M / mixture.crown_m)), HEIGHT_SCATTER)
        frames = _well_seen(cloud.points, FRAMES, WELL_SEEN)
        seen = Seen(cloud.points[frames], allowed)
        known_guess = [] if search else [_by_known(cloud, known, mixture)]
        guesses = known_guess or _guesses(cloud, allowed, mixture, prior)
        followed = [
            follow(seen, g.start_q, (g.share, g.place), mixture, size=g.size, arms=g.arms, size_prior=prior)
            for g in guesses
        ]
        followed = sorted(
            (f for f in followed if np.isfinite(f.log_likelihood)), key=lambda f: -f.log_likelihood
        )
        if not followed:
            return None
        scaled = [with_segments_scaled(seen, f, mixture, prior) for f in followed[:RIVALS]]
        score = np.array([f.log_likelihood + forwards(f, cloud.recording[frames], mixture) for f in scaled])
        return _judged(cloud.labels, scaled, score, seen, mixture)


@dataclass(frozen=True)
class _Cloud:
    labels: tuple[str, ...]
    points: Float[np.ndarray, "frames markers 3"]  # [m] NaN where unseen
    recording: Int[np.ndarray, " frames"]


@dataclass(frozen=True)
class _Guess:
    start_q: Float[np.ndarray, "starts dofs"]
    size: float
    arms: bool
    share: Float[np.ndarray, "markers landmarks"]
    body: Int[np.ndarray, " markers"]
    place: Float[np.ndarray, "markers 3"]  # NaN where the frame does not show the marker
    likely: float  # per seen marker


def _cloud(recordings: Sequence[Markers]) -> _Cloud | None:
    labels = tuple(dict.fromkeys(name for markers in recordings for name in markers.names))
    total = sum(markers.frames for markers in recordings)
    points, recording = [], []
    for which, markers in enumerate(recordings):
        wanted = max(2, round(MOST_FRAMES * markers.frames / max(1, total)))
        thin = np.unique(np.linspace(0, markers.frames - 1, min(wanted, markers.frames)).astype(int))
        column = {name: i for i, name in enumerate(markers.names)}
        own = np.full((len(thin), len(labels), 3), np.nan)
        for i, label in enumerate(labels):
            if label in column:
                own[:, i] = markers.positions_ground[thin, column[label]]
        points.append(own)
        recording.append(np.full(len(thin), which))
    if not points:
        return None
    everything = np.concatenate(points)
    ever = np.isfinite(everything).all(axis=2).any(axis=0)
    if ever.sum() < FEWEST_POINTS:
        return None
    names = tuple(label for label, known in zip(labels, ever, strict=True) if known)
    return _Cloud(names, everything[:, ever], np.concatenate(recording))


def _allowed(
    labels: Sequence[str], known: Mapping[str, str], mixture: LandmarkMixture
) -> Bool[np.ndarray, "markers landmarks"]:
    names = [mark.name for mark in mixture.landmarks]
    allowed = np.ones((len(labels), len(names)), dtype=bool)
    for i, label in enumerate(labels):
        if label in known:
            allowed[i] = [name == known[label] for name in names]
    return allowed


def _well_seen(
    points: Float[np.ndarray, "frames markers 3"], count: int, share: float
) -> Int[np.ndarray, " chosen"]:
    seen = np.isfinite(points).all(axis=2).sum(axis=1)
    good = np.flatnonzero(seen >= share * seen.max())
    return good[np.unique(np.linspace(0, len(good) - 1, min(count, len(good))).astype(int))]


def _guesses(
    cloud: _Cloud,
    allowed: Bool[np.ndarray, "markers landmarks"],
    mixture: LandmarkMixture,
    size_prior: tuple[float, float],
) -> list[_Guess]:
    """The best understandings of single frames that differ from one another."""
    found = []
    for frame in _references(cloud.points, REFERENCE_SHARES, WELL_SEEN):
        visible = np.isfinite(cloud.points[frame]).all(axis=1)
        laid = lay_over(cloud.points[frame, visible], allowed[visible], mixture, size_prior)
        for g in range(len(laid.guesses.q)):
            share = np.zeros(allowed.shape)
            share[visible] = laid.share[g]
            body = (share @ mixture.of_body).argmax(axis=1)
            size = float(laid.guesses.size[g])
            place = _places(cloud.points[frame] / size, laid.guesses.q[g], body, mixture)
            likely = float(laid.log_likelihood[g] / visible.sum())
            found.append(
                _Guess(
                    laid.guesses.q[g : g + 1], size, bool(laid.guesses.arms[g]), share, body, place, likely
                )
            )
    found = sorted((g for g in found if np.isfinite(g.likely)), key=lambda g: -g.likely)
    chosen: list[_Guess] = []
    for guess in found:
        if all(_differ(guess, other, DIFFER_SHARE) for other in chosen):
            chosen.append(guess)
        if len(chosen) == GUESSES:
            break
    return chosen


def _differ(one: _Guess, other: _Guess, share: float) -> bool:
    both = np.isfinite(one.place).all(axis=1) & np.isfinite(other.place).all(axis=1)
    return bool((one.body != other.body)[both].mean() > share) if both.any() else True


def _references(
    points: Float[np.ndarray, "frames markers 3"], shares: Sequence[float], well_seen: float
) -> list[int]:
    """Frames by how tall the cloud stands in them: the tallest, and some of the others."""
    seen = np.isfinite(points).all(axis=2).sum(axis=1)
    good = np.flatnonzero(seen >= well_seen * seen.max())
    low, high = np.nanpercentile(points[good, :, 1], (3, 97), axis=1)
    order = good[np.argsort(high - low)]
    return list(dict.fromkeys(int(order[round(share * (len(order) - 1))]) for share in shares))


def _places(
    points: Float[np.ndarray, "markers 3"],
    q: Float[np.ndarray, " dofs"],
    body: Int[np.ndarray, " markers"],
    mixture: LandmarkMixture,
) -> Float[np.ndarray, "markers 3"]:
    """Of each point in its body's frame [m]."""
    poses = mixture.kinematics.poses(q[None])
    R, p = poses.R_ground_body[0, body], poses.p_ground_body[0, body]
    return np.einsum("mji,mj->mi", R, points - p)


def _by_known(cloud: _Cloud, known: Mapping[str, str], mixture: LandmarkMixture) -> _Guess:
    """The known markers at their landmarks; the others wait for the poses."""
    names = [mark.name for mark in mixture.landmarks]
    share = np.zeros((len(cloud.labels), len(names)))
    place = np.full((len(cloud.labels), 3), np.nan)
    for i, label in enumerate(cloud.labels):
        if label in known:
            landmark = names.index(known[label])
            share[i, landmark], place[i] = 1.0, mixture.place_body[landmark]
    body = (share @ mixture.of_body).argmax(axis=1)
    return _Guess(mixture.skeleton.default_q[None], 1.0, True, share, body, place, 0.0)


def _judged(
    labels: Sequence[str],
    followed: Sequence[Followed],
    score: Float[np.ndarray, " rivals"],
    seen: Seen,
    mixture: LandmarkMixture,
) -> Recognition:
    """The understandings weighed against each other: where the likely ones differ, nobody is sure."""
    weight = np.exp((score - score.max()) / TEMPER)
    weight /= weight.sum()
    best = int(score.argmax())
    on_body = _on_bodies(followed, weight, seen, mixture)
    belief = np.einsum("h,hmb->mb", weight, on_body)
    body = belief.argmax(axis=1)
    names = mixture.skeleton.body_names
    found = []
    shapes = _shapes(followed[best], mixture)
    for i, label in enumerate(labels):
        of = best if on_body[best, i].argmax() == body[i] else int((weight * on_body[:, i, body[i]]).argmax())
        factors = followed[of].factors
        assert factors is not None
        measured, landmark, spread = (followed[of].attachment.place_body[i, body[i]], None, PLACE_STD_M)
        shape = shapes.get(int(body[i]))
        if of == best and shape is not None and i in shape.place_body:
            measured, landmark = shape.place_body[i], shape.at.get(i)
            spread = shape.spread_m.get(i, spread)
        others = tuple(
            (names[b], round(float(belief[i, b]), 3))
            for b in np.argsort(-belief[i])
            if b != body[i] and belief[i, b] >= LEAST
        )
        found.append(
            FoundMarker(
                label,
                landmark,
                names[body[i]],
                measured / factors[body[i]],
                spread,
                float(belief[i, body[i]]),
                others,
            )
        )
    sure = [f for f in found if f.confidence >= 0.5]
    person = len(sure) >= SURE_SHARE * len(found) and len({f.body for f in sure}) >= FEWEST_BODIES
    return Recognition(tuple(found), followed[best].size, person and len(found) >= FEWEST_MARKERS)


def _on_bodies(
    followed: Sequence[Followed], weight: Float[np.ndarray, " rivals"], seen: Seen, mixture: LandmarkMixture
) -> Float[np.ndarray, "rivals markers bodies"]:
    """Probability of each body for each marker, neighbours weighed, by each understanding.

    Understandings that put a marker on the same body share what was found there about its neighbours.
    """
    on_body = np.stack([f.attachment.on_body(mixture) for f in followed])
    body, best = on_body.argmax(axis=2), int(weight.argmax())
    on_body[best] = weighed_against_neighbours(seen, followed[best], mixture)
    for h, f in enumerate(followed):
        if h == best or weight[h] < EXAMINED_LIKELIHOOD_SHARE:
            continue
        alike = body[h] == body[best]
        on_body[h] = weighed_against_neighbours(seen, f, mixture, np.flatnonzero(~alike).tolist())
        on_body[h, alike] = on_body[best, alike]
    return on_body


def _shapes(followed: Followed, mixture: LandmarkMixture) -> dict[int, BodyShape]:
    """Of each body with markers, by its index: which of them are at its landmarks, and where they lie."""
    taken, own = _landmarks(followed, mixture), followed.own(mixture)
    body_of_marker = followed.attachment.on_body(mixture).argmax(axis=1)
    shapes = {}
    for body in np.unique(body_of_marker):
        places = {
            int(i): followed.attachment.place_body[i, body] for i in np.flatnonzero(body_of_marker == body)
        }
        shapes[int(body)] = by_shape({i: taken[i] for i in places if i in taken}, places, own)
    return shapes


def _landmarks(followed: Followed, mixture: LandmarkMixture) -> dict[int, Landmark]:
    """Which single place a marker is at, the likeliest first, one marker a place."""
    share = followed.attachment.share
    body = followed.attachment.on_body(mixture).argmax(axis=1)
    own = share * (mixture.body[None] == body[:, None])
    own = own / np.maximum(own.sum(axis=1, keepdims=True), 1e-12)
    found: dict[int, Landmark] = {}
    for i in np.argsort(-own.max(axis=1)):
        mark = mixture.landmarks[int(own[i].argmax())]
        sure = own[i].max() >= SURE_LANDMARK
        if sure and not mark.tracks_only and mark.kind != "centre" and mark not in found.values():
            found[int(i)] = mark
    return found
