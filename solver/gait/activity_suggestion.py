"""Suggests what a person does on which frames of a trial; a person confirms it, changes it or refuses it."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np
from jaxtyping import Float, Int

from solver.common.errors import ModelError
from solver.common.gravity import GRAVITY
from solver.common.true_runs import runs
from solver.contact.wrenches import ContactWrenches
from solver.fitting.fit_result import TrialFit
from solver.fitting.seen_part import seen_part
from solver.gait.activity import BY_RULE, BY_UNLEARNT_RULE, LEARNT, Activity, ActivitySuggestion
from solver.gait.activity_model import (
    HOP_S,
    WINDOW_S,
    Weights,
    all_classes,
    features_of,
    learnt_weights,
    shares,
    smooth_probabilities,
    windows_of,
)
from solver.gait.activity_rules import kind_of, unlearnt
from solver.gait.body_motion import BodyMotion, body_motion
from solver.gait.settings import GAIT, GaitSettings
from solver.skeleton.skeleton import Skeleton

LEAST_CONFIDENCE = 0.6  # below, nothing is suggested: a person looks anyway
LEAST_OWN_SHARE = 0.4  # of a window in its stretch; below, it looks like something else
NAMED_ODDS = 3.0  # a trial's name is often right, and also says what people only meant to do

FEWEST_FRAMES = 10  # a spline and a filter need as many

_NAMES = (
    (Activity.SIT_TO_STAND, r"sit.?(2|to).?stand|stand.?(2|to).?sit|\bsts|\bchair"),
    (Activity.STAIRS, r"\bstair|steps?.?(up|down)"),
    (Activity.LUNGE, r"\blunge"),
    (Activity.JUMP, r"jump|\bhop|\bland|\bdrop|\b(sl)?dj|\bcmj|\bsj"),
    (Activity.SQUAT, r"\bsquat"),
    (Activity.RUNNING, r"\brun|\bsprint|\bjog"),
    (Activity.WALKING, r"\bwalk|\bgait|ground|\btreadmill"),
    (Activity.STANDING, r"\bstand|\bstatic|\bcalib|\bbalance|\bquiet"),
)  # the first that is in a name counts


def suggested_activities(
    trial: TrialFit, skeleton: Skeleton, gait: GaitSettings = GAIT
) -> tuple[ActivitySuggestion, ...]:
    """What the person seems to do, in order of time; frames of which nothing is sure enough are in none.

    Args:
        trial: solved.
        skeleton: fitted.
        gait: of gait events.
    """
    trial = seen_part(trial)
    motion = trial.kinematics_only.motion if trial.kinematics_only else trial.motion
    if trial.contacts is None or motion.frames < FEWEST_FRAMES or len(trial.contacts.foot_bodies) != 2:
        return ()
    try:
        load = load_of(trial.contacts, skeleton.mass)
        seen = body_motion(skeleton, trial.contacts.foot_bodies, motion, gait, load)
    except ModelError:
        return ()  # a body that forces act on, and no foot with toes below a leg
    first = trial.capture.markers.first_frame
    found = suggest_activities(seen, trial.capture.name, learnt_weights())
    return tuple(replace(one, start=one.start + first, end=one.end + first) for one in found)


def suggest_activities(motion: BodyMotion, name: str, weights: Weights) -> tuple[ActivitySuggestion, ...]:
    """Likewise, from the motion alone.

    Args:
        motion: of the trial.
        name: of the trial: a weak hint.
        weights: of the learnt classes.
    """
    windows = windows_of(motion)
    probabilities = _probabilities(motion, windows.spans, name, weights)
    time_history = smooth_probabilities(probabilities)
    found = []
    for first, last, place in _stretches(time_history, probabilities):
        activity = all_classes()[place]
        confidence = float(probabilities[first:last, place].mean())
        if confidence < LEAST_CONFIDENCE:
            continue
        span = windows.cells[first][0], windows.cells[last - 1][1]
        by = BY_RULE if activity in LEARNT else BY_UNLEARNT_RULE
        kind = kind_of(motion, activity, span)
        found.append(ActivitySuggestion(*span, activity, kind, round(confidence, 3), by))
    return tuple(found)


def _stretches(
    time_history: Int[np.ndarray, " windows"], probabilities: Float[np.ndarray, "windows classes"]
) -> Iterator[tuple[int, int, int]]:
    """First window, the one after the last, and class; without windows that speak against their time history.

    Such windows are cut off at the ends of a time history, and inside it where they are as long as a window.
    """
    likely = probabilities[np.arange(len(time_history)), time_history] >= LEAST_OWN_SHARE
    longest = WINDOW_S / HOP_S
    for place, group in groupby(range(len(time_history)), key=lambda k: int(time_history[k])):
        cells = list(group)
        joined: list[tuple[int, int]] = []
        for start, end in runs(likely[cells]):
            if joined and start - joined[-1][1] < longest:
                joined[-1] = joined[-1][0], end
            else:
                joined.append((start, end))
        yield from ((cells[0] + start, cells[0] + end, place) for start, end in joined)


def named_activity(name: str) -> Activity | None:
    """What a trial's name says that people do in it; None where it says nothing.

    Args:
        name: of the trial or its file.
    """
    words = re.sub(r"(?<=[a-z])(?=[A-Z])|[_\-.]+", " ", name).lower()
    return next((activity for activity, pattern in _NAMES if re.search(pattern, words)), None)


def _probabilities(
    motion: BodyMotion, spans: Sequence[tuple[int, int]], name: str, weights: Weights
) -> Float[np.ndarray, "windows classes"]:
    """Of every class in each window: rules take their share first, the learnt classes have the rest."""
    learnt = shares(weights, np.array([features_of(motion, span) for span in spans]))
    by_rule = [unlearnt(motion, span) for span in spans]
    ruled = np.array([[rules[a] for a in all_classes()[len(LEARNT) :]] for rules in by_rule])
    most = ruled.max(axis=1, keepdims=True)
    ruled = np.where(ruled == most, ruled, 0.0)
    ruled /= np.maximum(ruled.sum(axis=1, keepdims=True) / np.maximum(most, 1e-12), 1e-12)
    together = np.column_stack([(1 - most) * learnt, ruled])
    said = named_activity(name)
    if said is not None:
        together[:, all_classes().index(said)] *= NAMED_ODDS
    return together / together.sum(axis=1, keepdims=True)


def load_of(contacts: ContactWrenches, mass_kg: float) -> Float[np.ndarray, " frames"] | None:
    """Vertical force of all plates [body weights]; NaN where nothing was recorded, None without plates.

    Args:
        contacts: of the trial.
        mass_kg: of the person.
    """
    if not contacts.has_plates:
        return None
    load = contacts.wrench_ground[:, :, 1].sum(axis=1) / (mass_kg * GRAVITY)
    return np.where(contacts.observed, load, np.nan)
