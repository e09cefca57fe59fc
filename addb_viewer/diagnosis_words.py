"""A diagnosis as a page for people: sections of plain sentences, for the terminal, the app and the report.

Takes the plain values of `diagnose --json`, so that a kept diagnosis reads like a new one.
"""

from collections.abc import Mapping
from typing import Any

from addb_viewer.diagnosis_vocabulary import (
    amounts,
    certainty,
    listed,
    newtons,
    ranges_of,
    sentence,
    target_in_words,
    title,
    upward,
)
from addb_viewer.residual_words import WITHIN, what_is_wrong
from addb_viewer.sections import Section

NOW_AND_THEN = ("off_plate_step", "external_contact")  # each time with a force of its own
AT_CERTAIN_FRAMES = (*NOW_AND_THEN, "marker_slip", "marker_swap")
CERTAIN_PER_CENT = 95
SPREAD = "±: in 19 of 20 cases the true value lies within."

Figures = Mapping[str, Any]


def page(figures: Figures) -> list[Section]:
    """The whole answer, the verdict first.

    Args:
        figures: in the shape of `diagnose --json`.
    """
    causes = [cause(figures, k) for k in range(len(figures["effects"]))]
    sections = [
        verdict(figures),
        what_is_wrong(figures),
        *causes,
        what_it_gains(figures),
        what_remains(figures),
    ]
    notes = Section("Notes", tuple(figures.get("notes", ())))
    return [s for s in (*sections, notes) if s.lines or s.rows]


def verdict(figures: Figures) -> Section:
    """One sentence: sound, wrong and why, or wrong and nobody knows why."""
    effects = figures["effects"]
    one = len(effects) == 1
    short = [_in_short(figures, effect) for effect in effects]
    named = "; ".join(short if one else [f"({k}) {text}" for k, text in enumerate(short, start=1)])
    of = _recordings(figures)
    if figures["verdict"] == "clean":
        text = f"Nothing wrong was found in {of}."
    elif figures["verdict"] == "explained":
        account = "one cause accounts for it" if one else f"{len(effects)} causes together account for it"
        text = f"Something is wrong with {of}, and {account}: {named}."
    elif effects:
        found = "one cause was found" if one else f"{len(effects)} causes were found"
        text = (
            f"Something is wrong with {of}; {found} ({named}), but that does not account for all of it. "
            "The rest is unexplained."
        )
    else:
        text = f"Something is wrong with {of}, and no cause that this program knows accounts for it."
    return Section("Verdict", (text,))


def cause(figures: Figures, k: int) -> Section:
    """The k-th cause: meaning, size, time, certainty, remedy, and what looks alike."""
    effect = figures["effects"][k]
    rivals = rivals_of(figures, effect)
    rows = [
        ("what it is", sentence(effect)),
        ("how large", "; ".join(amounts(effect))),
        ("when", when(figures, effect)),
        ("how sure", certainty(effect["confidence"], len(rivals))),
        ("what to do", " ".join([effect.get("remedy", ""), *_flag_hint(figures, effect)]).strip()),
    ]
    if rivals:
        rows.append(("could also be", "; ".join(title(r) for r in rivals)))
        told_apart = dict.fromkeys(r["separate_by"] for r in rivals if r["separate_by"])
        rows.append(("to tell, record", "; or ".join(told_apart)))
    heading = f"Cause {k + 1} of {len(figures['effects'])}: {title(effect)}"
    return Section(heading, rows=tuple(row for row in rows if row[1]))


def rivals_of(figures: Figures, effect: Figures) -> list[Figures]:
    """Alternatives that this recording cannot tell from a cause."""
    name, several = f"{effect['id']} {effect['target']}", len(figures["effects"]) > 1
    return [a for a in figures["alternatives"] if a.get("instead_of", None if several else name) == name]


def when(figures: Figures, effect: Figures) -> str:
    """The frames on which a cause acts, as people count them: the last one included."""
    ranges = sorted(ranges_of(figures, effect))
    trials = list(dict.fromkeys(trial for trial, _, _ in ranges))
    if effect["id"] not in AT_CERTAIN_FRAMES:
        return f"all the time, in {listed(trials)}" if trials else ""
    said = []
    for trial, start, end in ranges:
        rate = figures.get("rates_Hz", {}).get(trial)
        seconds = f" ({start / rate:.2f} to {(end - 1) / rate:.2f} s)" if rate else ""
        said.append(f"{trial}, frames {start} to {end - 1}{seconds}")
    return "; ".join(said)


def what_it_gains(figures: Figures) -> Section:
    """The same figures without and with the causes, on stretches that were withheld."""
    gain = figures["gain"]
    if not gain:
        return Section("What that is worth")
    rows = []
    for label, name, unit, factor, digits in (
        ("force", "heldout_linear_residual_N", "N", 1.0, 0),
        ("moment", "heldout_angular_residual_Nm", "N·m", 1.0, 1),
        ("markers", "marker_rms_m", "mm", 1e3, 1),
    ):
        if name in gain:
            rows.append((label, before_and_after(gain[name], unit, factor, digits)))
    lines = [
        "Differences without → with the named causes. Each half second of force was withheld in turn and "
        "predicted from all the others, so that this cannot be bought by fitting harder."
    ]
    linear = gain.get("heldout_linear_residual_N")
    if linear is not None:
        lines.append(_worth(figures, linear))
    return Section("What that is worth", tuple(lines), tuple(rows))


def what_remains(figures: Figures) -> Section:
    """What no cause accounts for, and where it acts."""
    remaining = figures["remaining"]
    left, floor, location = remaining["linear_residual_N"], remaining["noise_floor_N"], remaining["location"]
    if figures["verdict"] == "clean":
        return Section("What remains")
    if figures["verdict"] == "explained":
        if left > WITHIN * floor and _now_and_then(figures):
            return Section("What remains", ("Away from the frames named above, nothing else stands out.",))
        return Section(
            "What remains",
            (f"{newtons(left)}, where about {newtons(floor)} is ordinary. Nothing else stands out.",),
        )
    lines = [f"{newtons(left)}, where about {newtons(floor)} is ordinary."]
    if location is None:
        lines.append(
            "It cannot be tied to one part of the body. It may be a cause that this program does not know, "
            "or several at once."
        )
    else:
        force = location["mean_force_N"]
        size = sum(f * f for f in force) ** 0.5
        lines.append(
            f"It looks like a force on this part of the body: {target_in_words(location['body'])}, "
            f"{newtons(location['rms_force_N'])} (root mean square), on average {newtons(size)} "
            f"{upward(force)}. "
            f"What it depends on: {location['depends_on']}."
        )
    lines.append(
        "What to do: look at the video for what touches the person, and at notes of the session; do not use "
        "forces and joint torques of this recording before it is understood."
    )
    return Section("What remains", tuple(lines))


def _in_short(figures: Figures, effect: Figures) -> str:
    rivals = rivals_of(figures, effect)
    if rivals:
        return " — or else ".join(title(e) for e in (effect, *rivals))
    return f"{title(effect)} [{certainty(effect['confidence'], 0).split(' (')[0].split(':')[0]}]"


def _recordings(figures: Figures) -> str:
    trials = figures.get("trials", ())
    if len(trials) == 1:
        return f"the recording '{trials[0]}'"
    return f"these recordings ({listed(trials)})" if trials else "this recording"


def before_and_after(gain: Figures, unit: str, factor: float, digits: int) -> str:
    """A figure without and with the causes, and between which bounds the latter lies."""
    text = f"{factor * gain['before']:.{digits}f} → {factor * gain['after']:.{digits}f} {unit}"
    if gain.get("interval"):
        low, high = (factor * bound for bound in gain["interval"])
        text += f"   (between {low:.{digits}f} and {high:.{digits}f} with {CERTAIN_PER_CENT} % certainty)"
    return text


def _worth(figures: Figures, gain: Figures) -> str:
    before, after, interval = gain["before"], gain["after"], gain.get("interval")
    if interval and interval[1] < before:
        return f"The difference in force falls by {100 * (1 - after / before):.0f} %, and not by chance."
    if _now_and_then(figures):
        return (
            "A step or a contact has its own force each time: when its frames are withheld, nothing can "
            "foretell it, so that these figures stay high there. What speaks for it is the force's place, "
            "time and sign."
        )
    return "On withheld stretches the gain is not certain: take the causes as a lead, not as a finding."


def _now_and_then(figures: Figures) -> bool:
    return any(effect["id"] in NOW_AND_THEN for effect in figures["effects"])


def _flag_hint(figures: Figures, effect: Figures) -> list[str]:
    if effect["id"] != "off_plate_step":
        return []
    foot = "both" if effect["target"].startswith("plate_") else effect["target"]
    return [
        f"To flag: addb-viewer flag SUBJECT {trial} {start}:{end} --foot {foot} --reason notOverForcePlate."
        for trial, start, end in sorted(ranges_of(figures, effect))
    ]
