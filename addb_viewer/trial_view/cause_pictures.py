"""What a diagnosis looks like in the scene of one trial, as plain arrays: a picture for each cause.

A cause that has no place is a label above the person.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from addb_viewer.text.diagnosis_vocabulary import about, amount, target_in_words, title
from addb_viewer.text.plain_words import in_plain_words
from addb_viewer.trial_view.replay import PlateReplay, Replay
from solver.diagnosis.causes.about import (
    AgainstMotion,
    Arrow,
    Ball,
    Band,
    Markers,
    Plates,
    Segments,
    Steady,
)
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport

CAUSE_METRES_PER_NEWTON = 4e-3  # a hand's push of 40 N is still to be seen beside ground forces
LARGE_METRES_PER_NEWTON = 1e-3  # like ground forces: steps, and whatever else would leave the picture
LARGE_N = 250.0  # from which on it would
LOAD_DENSITY = 1500.0  # [kg/m³] between water and iron: how large a ball a carried mass is drawn as
LOADED_N = 20.0  # a plate without known corners lies where it was loaded by more than that
SLOWEST_M_PER_S = 1e-6  # keeps powers of the speed finite


@dataclass(frozen=True, eq=False)
class Picture:
    """One cause in one trial; whatever it lacks is None or empty."""

    label: str
    acts: Bool[np.ndarray, " frames"]
    place: Float[np.ndarray, "frames 3"] | None = None  # [m] of force, ball and label; None: no place
    force: Float[np.ndarray, "frames 3"] | None = None  # [N] on the person
    metres_per_newton: float = CAUSE_METRES_PER_NEWTON
    radius: float | None = None  # [m] of a ball
    anchor: Float[np.ndarray, "3"] | None = None  # [m] the other end of a band
    outline: Float[np.ndarray, "edges 2 3"] | None = None  # [m]
    markers: tuple[int, ...] = ()
    bodies: tuple[int, ...] = ()


def pictures(figures: DiagnosisReport, replay: Replay) -> tuple[Picture, ...]:
    """Every cause that acts in this trial, and what remains unexplained.

    Args:
        figures: of the diagnosis.
        replay: the trial.
    """
    found = []
    for effect in figures.effects:
        acts = np.zeros(replay.frames, dtype=bool)
        for trial, start, end in effect.frames:
            acts[start:end] |= trial == replay.name
        if acts.any():
            found.append(_painted(effect, replay, Picture(_short(effect), acts)))
    return (*found, *_unexplained(figures, replay))


def _unexplained(figures: DiagnosisReport, replay: Replay) -> tuple[Picture, ...]:
    location = figures.remaining.location
    if figures.verdict != "unexplained" or location is None or replay.name not in figures.trials:
        return ()
    body = in_plain_words(target_in_words(location.body))
    words = f"unexplained: {body}, {location.rms_force_N:.0f} N RMS"
    bare = Picture(words, np.ones(replay.frames, dtype=bool))
    mean = np.tile(np.array(location.mean_force_N), (replay.frames, 1))
    pushed = _pushed(bare, replay, location.body, mean)
    return (replace(pushed, label=words),)


def _short(effect: Cause) -> str:
    """Without the segment, which is seen."""
    words = in_plain_words(title(effect))
    return words if about(effect).picture is None else words.split(": ")[0]


def _painted(effect: Cause, replay: Replay, bare: Picture) -> Picture:
    """What the cause says of its picture, drawn in this trial."""
    match about(effect).picture:
        case Arrow() as arrow:
            return _arrow(arrow, effect, replay, bare)
        case Ball() as ball:
            return _load(ball, effect, replay, bare)
        case Segments():
            return _segments(effect, replay, bare)
        case Markers():
            return _markers(effect, replay, bare)
        case Plates() as plates:
            return _plates(plates, effect, replay, bare)
    return bare


def _arrow(arrow: Arrow, effect: Cause, replay: Replay, bare: Picture) -> Picture:
    """A force where it acts; the target's segments alone where its size or its place is not known."""
    if effect.target.startswith("plate_"):
        return _plates(Plates(), effect, replay, bare)
    place = _on_body(replay, effect.target, _vector(effect, arrow.point))
    marked = replace(bare, bodies=_bodies(replay, effect.target), place=place)
    time_history = _time_history(effect, replay)
    if isinstance(arrow.force, Band):
        marked = replace(marked, anchor=_vector(effect, arrow.force.anchor))
    force = _force(arrow.force, effect, replay, place) if time_history is None else time_history
    if force is None or place is None:
        return marked if arrow.like_ground_force else bare
    drawn = _with_force(marked, place, force)
    if arrow.like_ground_force:
        drawn = replace(drawn, metres_per_newton=LARGE_METRES_PER_NEWTON)
    mean = _mean_N(arrow.force, effect) if arrow.mean_on_label else None
    return drawn if mean is None else replace(drawn, label=_labelled(bare, mean))


def _mean_N(force: Steady | Band | AgainstMotion, effect: Cause) -> float | None:
    """By the parameters."""
    if not isinstance(force, Steady):
        return None
    vector = _vector(effect, force.vector)
    return _value(effect, force.upward) if vector is None else float(np.linalg.norm(vector))


def _force(
    force: Steady | Band | AgainstMotion,
    effect: Cause,
    replay: Replay,
    place: Float[np.ndarray, "frames 3"] | None,
) -> Float[np.ndarray, "frames 3"] | None:
    """On the person, in every frame [N]; None where the parameters do not tell it."""
    if isinstance(force, Steady):
        upward = _value(effect, force.upward)
        vector = _vector(effect, force.vector)
        if vector is None and upward is not None:
            vector = np.array([0.0, upward, 0.0])
        return None if vector is None else np.tile(vector, (replay.frames, 1))
    if place is None:
        return None
    return (
        _by_band(force, effect, place) if isinstance(force, Band) else _against(force, effect, replay, place)
    )


def _by_band(
    band: Band, effect: Cause, place: Float[np.ndarray, "frames 3"]
) -> Float[np.ndarray, "frames 3"] | None:
    anchor = _vector(effect, band.anchor)
    if anchor is None:
        return None
    offset = anchor - place
    length = np.maximum(np.linalg.norm(offset, axis=1, keepdims=True), 1e-6)
    tension = np.full_like(length, _value(effect, band.mean) or 0.0)
    stiffness, rest = _value(effect, band.stiffness), _value(effect, band.rest_length)
    if stiffness is not None and rest is not None:
        tension = stiffness * (length - rest)
    return tension * offset / length


def _against(
    drag: AgainstMotion, effect: Cause, replay: Replay, place: Float[np.ndarray, "frames 3"]
) -> Float[np.ndarray, "frames 3"] | None:
    b, exponent = _value(effect, drag.b), _value(effect, drag.exponent)
    if b is None:
        return None
    velocity = np.gradient(place, 1 / replay.rate, axis=0)
    speed = np.maximum(np.linalg.norm(velocity, axis=1, keepdims=True), SLOWEST_M_PER_S)
    return -b * speed ** ((1.0 if exponent is None else exponent) - 1) * velocity


def _load(ball: Ball, effect: Cause, replay: Replay, bare: Picture) -> Picture:
    mass = _value(effect, ball.mass)
    place = _on_body(replay, effect.target, _vector(effect, ball.point))
    if mass is None or place is None:
        return bare
    radius = float(np.cbrt(3 * max(mass, 0.1) / (4 * np.pi * LOAD_DENSITY)))
    return replace(bare, label=f"{bare.label}, {amount(mass, None, 'kg')}", place=place, radius=radius)


def _segments(effect: Cause, replay: Replay, bare: Picture) -> Picture:
    bodies = _bodies(replay, effect.target)
    place = _on_body(replay, effect.target.split("+")[0])
    return replace(bare, bodies=bodies, place=place)


def _markers(effect: Cause, replay: Replay, bare: Picture) -> Picture:
    names = [name for name in effect.target.split("+") if name in replay.markers.names]
    found = tuple(replay.markers.names.index(name) for name in names)
    if not found:
        return bare
    seen = replay.markers.measured[:, found[0]]
    return replace(bare, markers=found, place=seen)


def _plates(plates: Plates, effect: Cause, replay: Replay, bare: Picture) -> Picture:
    """The plates' outlines; where the cause is their place, the outline of the place they really have."""
    corners = [_corners(replay, name) for name in effect.target.split("+")]
    known = [_moved_back(plates, effect, c) for c in corners if c is not None]
    if not known:
        return bare
    label = f"{bare.label}: it lies here" if plates.shift or plates.yaw else bare.label
    outline = np.concatenate([np.stack([c, np.roll(c, -1, axis=0)], axis=1) for c in known])
    side = known[0].mean(axis=0)
    return replace(bare, label=label, outline=outline, place=np.tile(side, (replay.frames, 1)))


def _moved_back(plates: Plates, effect: Cause, corners: Float[np.ndarray, "4 3"]) -> Float[np.ndarray, "4 3"]:
    shift = np.array([_value(effect, plates.shift.format(axis)) or 0.0 for axis in "xyz"])
    back = Rotation.from_euler("y", -(_value(effect, plates.yaw) or 0.0), degrees=True)
    centre = corners.mean(axis=0)
    return centre - shift + back.apply(corners - centre)


def _corners(replay: Replay, target: str) -> Float[np.ndarray, "4 3"] | None:
    """As the file has them, else around the centres of pressure of the loaded plate; None if never loaded."""
    number = target.removeprefix("plate_")
    if not number.isdigit() or not 1 <= int(number) <= len(replay.plates):
        return None
    plate: PlateReplay = replay.plates[int(number) - 1]
    if plate.corners is not None and np.isfinite(plate.corners).all():
        return plate.corners
    loaded = np.isfinite(plate.cop).all(axis=1) & (np.linalg.norm(plate.force, axis=1) >= LOADED_N)
    if not loaded.any():
        return None
    (low_x, y, low_z), (high_x, _, high_z) = plate.cop[loaded].min(axis=0), plate.cop[loaded].max(axis=0)
    around = [[low_x, y, low_z], [high_x, y, low_z], [high_x, y, high_z], [low_x, y, high_z]]
    return np.array(around)


def _pushed(
    bare: Picture,
    replay: Replay,
    body: str,
    force: Float[np.ndarray, "frames 3"],
    point_body: Float[np.ndarray, "3"] | None = None,
) -> Picture:
    place = _on_body(replay, body, point_body)
    marked = replace(bare, bodies=_bodies(replay, body))
    return bare if place is None else _with_force(marked, place, force)


def _with_force(
    bare: Picture, place: Float[np.ndarray, "frames 3"], force: Float[np.ndarray, "frames 3"]
) -> Picture:
    sizes = np.linalg.norm(force[bare.acts], axis=1)
    known = sizes[np.isfinite(sizes)]
    label = _labelled(bare, float(known.mean())) if known.size else bare.label
    large = known.size > 0 and known.max() > LARGE_N
    scale = LARGE_METRES_PER_NEWTON if large else CAUSE_METRES_PER_NEWTON
    return replace(bare, label=label, place=place, force=force, metres_per_newton=scale)


def _labelled(bare: Picture, mean_N: float) -> str:
    return f"{bare.label}, {mean_N:.0f} N"


def _time_history(effect: Cause, replay: Replay) -> Float[np.ndarray, "frames 3"] | None:
    """The force over time as it was fitted [N], NaN where it does not act; None: only its mean is known."""
    own = [c for c in effect.time_histories if c.trial == replay.name and c.force_N]
    if not own:
        return None
    force = np.full((replay.frames, 3), np.nan)
    for time_history in own:
        samples = np.array(time_history.force_N)
        at = time_history.start + time_history.step * np.arange(len(samples))
        frames = np.arange(at[0], min(at[-1] + time_history.step, replay.frames))
        force[frames] = np.stack([np.interp(frames, at, samples[:, i]) for i in range(3)], axis=1)
    return force


def _on_body(
    replay: Replay, body: str, point_body: Float[np.ndarray, "3"] | None = None
) -> Float[np.ndarray, "frames 3"] | None:
    """Path of a point of a body, its centre of mass unless told otherwise [m]; None without that body."""
    if replay.bodies is None or body not in replay.bodies.names:
        return None
    return replay.bodies.point_ground(replay.bodies.names.index(body), point_body)


def _bodies(replay: Replay, target: str) -> tuple[int, ...]:
    """Segments of a target; with the heel bone, the toes of the same foot."""
    if replay.bodies is None:
        return ()
    names = target.split("+")
    names += [name.replace("calcn", "toes") for name in names if "calcn" in name]
    return tuple(replay.bodies.names.index(name) for name in names if name in replay.bodies.names)


def _value(effect: Cause, parameter: str) -> float | None:
    estimate = effect.parameters.get(parameter)
    return None if estimate is None else estimate.value


def _vector(effect: Cause, parameter: str) -> Float[np.ndarray, "3"] | None:
    """Three parameters that differ in their axis; None where one is not known."""
    values = [_value(effect, parameter.format(axis)) for axis in "xyz"]
    return None if None in values else np.array(values, dtype=float)
