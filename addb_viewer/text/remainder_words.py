"""What no cause accounts for, and what to do next with the recording."""

from addb_viewer.text.diagnosis_vocabulary import (
    CONFIDENT,
    about,
    names_of,
    newtons,
    rivals_of,
    target_in_words,
    tentative_of,
    upward,
)
from addb_viewer.text.gain_words import is_tentative, now_and_then, speeds_up
from addb_viewer.text.residual_words import (
    WITHIN,
    corrected_on_reading,
    is_whole,
    moment_Nm,
    nothing_corrects,
    ratios,
    times,
)
from addb_viewer.text.sections import Section
from solver.diagnosis.causes.about import CorrectedBy
from solver.diagnosis.causes.catalogue import cannot_be_accepted
from solver.diagnosis.diagnosis import Unlisted
from solver.diagnosis.diagnosis_report import DiagnosisReport

OF_A_CLASS = ("plate", "time")  # what is off the list and can be told as such
SWINGS = "swings"  # says a time history that swings evenly
MOST = 0.5  # of an error that is left where most of it is explained
CHECKED = "First do what each cause says under 'what to do'; if that confirms it, "
MORE = 1.1  # times what is ordinary, from which on the ratio is told


def what_remains(figures: DiagnosisReport) -> Section:
    """What no cause accounts for, and where it acts."""
    if figures.verdict == "clean":
        return Section("What remains")
    if figures.verdict == "explained":
        return Section("What remains", (_left(figures), _nothing_else(figures)))
    location = figures.remaining.location
    lines = [_left(figures)]
    known = figures.remaining.off_the_list
    if known is not None and known.touches in OF_A_CLASS:
        lines.append(_of_a_class(figures, known))
    elif location is None:
        lines.append(
            "It cannot be tied to one part of the body. It may be a cause that this program does not know, "
            "or several at once."
        )
        if _mostly_turns(figures):
            lines.append(
                "It turns the body more than it pushes it: check the plates' free moments with sign and "
                "unit, their places and axes, and look for what spins or twists."
            )
    else:
        force = location.mean_force_N
        size = sum(f * f for f in force) ** 0.5
        lines.append(
            f"It looks like a force on this part of the body: {target_in_words(location.body)}, "
            f"{newtons(location.rms_force_N)} (root mean square), on average {newtons(size)} "
            f"{upward(force)}. "
            f"{_dependence(location.depends_on)} This is where it fits best, not where it is proven to "
            "act."
        )
    if location is not None and SWINGS in location.depends_on:
        lines.append(
            "An even oscillation is often not a force: look first for a shaking camera, or loose markers "
            "there."
        )
    lines.append(
        "What to do: look at the video for what touches the person, and at notes of the session. Which of "
        "the two is at fault, motion or forces, is not known."
    )
    return Section("What remains", tuple(lines))


def _of_a_class(figures: DiagnosisReport, known: Unlisted) -> str:
    """What is at fault where no name holds."""
    where = f" in {known.trial}" if known.trial and len(figures.trials) > 1 else ""
    size = f"{newtons(known.rms_force_N)} (root mean square)"
    if known.touches == "plate":
        plate = target_in_words(known.target)
        return (
            f"Something is wrong with {plate}{where}, {size} while it is loaded: an unknown fault of this "
            "plate describes it better than every known cause. Check its sign, zero, units, place and axes, "
            "and what stood on it."
        )
    return (
        f"The time of the forces is off{where}, {size}, in a way that no known fault of clock, rate or "
        "filter describes. Check triggers, lost frames, and plates that run on clocks of their own."
    )


def _dependence(depends_on: str) -> str:
    """On what the force depends; of an even swing how fast it is."""
    if SWINGS in depends_on:
        return f"It swings{depends_on.split(SWINGS, 1)[1]}."
    return f"What it depends on: {depends_on}."


def what_next(figures: DiagnosisReport) -> Section:
    """What to do with this recording, in the program."""
    several = len(figures.trials) > 1
    recording = "these recordings" if several else "this recording"
    corrected = [e for e in figures.effects if corrected_on_reading(e)]
    in_the_markers = [e for e in figures.effects if cannot_be_accepted(e.id)]
    exchanged = [e for e in figures.effects if about(e).in_markers and e not in in_the_markers]
    also = " else" if corrected or exchanged else ""
    as_recorded = f"Until then, fits correct nothing{also} in {recording}."
    slipped = [e for e in in_the_markers if not nothing_corrects(e)]
    apart = len(corrected) + len(in_the_markers) + len(exchanged)
    lines = []
    unmeasured = any(about(e).corrected_by is CorrectedBy.FLAGGED for e in figures.effects)
    if unmeasured:
        lines.append("Flag the frames of the unmeasured step first, as shown above, or repeat the trial.")
    if corrected:
        lines.append("Every fit already corrects the bias that was taken off as a zero level.")
    if exchanged:
        lines.append(
            "Fits exchange such labels back where they find them, and say so in their notes; "
            "`addb-viewer accept SUBJECT` does it for these frames in every later fit."
        )
    if len(slipped) < len(in_the_markers):
        lines.append(
            "Sliding markers cannot be corrected: do not trust the joints at that segment, or leave out the "
            'worst markers (`addb-viewer markers SUBJECT` writes a map; set them to "" there) and fit again.'
        )
    if slipped:
        lines.append("Correct the markers and diagnose again.")
    if tentative_of(figures):
        lines.append(
            "Look into what is only tentative by what stands there under 'what to do'. Beside named causes "
            "`addb-viewer accept` leaves it out."
        )
    if len(names_of(figures)) > apart:
        lead = (
            "First check what is only tentative, see above. If it is confirmed, "
            if is_tentative(figures)
            else ""
        )
        if any(rivals_of(figures, e) and e.confidence < CONFIDENT for e in names_of(figures)):
            lead = (
                f"{'Then' if unmeasured else 'First'} tell apart the causes that look alike here, see above. "
                + ("Then check what is only tentative. " if lead else "")
                + "If those named first are confirmed, "
            )
        which = "the other causes" if apart else "the causes"
        lines.append(
            f"{lead or CHECKED}`addb-viewer accept SUBJECT` makes every later fit correct {which}, and "
            "`addb-viewer reject SUBJECT` undoes that. The files are not changed: other programs still read "
            "the fault from them."
        )
    if slipped or len(names_of(figures)) > apart:
        lines.append(as_recorded)
    if figures.verdict == "unexplained":
        lines.append(f"Do not use {recording} for joint torques before the cause of what remains is known.")
    return Section("What next", tuple(lines))


def _mostly_turns(figures: DiagnosisReport) -> bool:
    """Whether the residual is beyond the ordinary in its moment, and less so in its force."""
    residual = figures.residual
    if figures.effects or residual is None:
        return False
    force, moment = ratios(residual)
    return bool(moment > max(WITHIN, force))


def explains_most(figures: DiagnosisReport) -> bool:
    """Whether causes take half of what force is off by on hidden stretches, or more."""
    force = figures.gain.get("held_out_linear_residual_N")
    return force is None or bool(force.after <= MOST * force.before)


def _left(figures: DiagnosisReport) -> str:
    """How large what remains is: force and moment, each against what is ordinary where that is known."""
    remaining, gain, residual = figures.remaining, figures.gain, figures.residual
    if not figures.effects and residual is not None:
        of_force, of_moment = ratios(residual)
        force, moment = newtons(residual.force_N), moment_Nm(residual.moment_Nm)
        if max(of_force, of_moment) <= WITHIN:
            return f"All of the residual: {force} and {moment}, ordinary in size but not in its pattern."
        return (
            f"All of the residual: force {_against(force, of_force)}; moment {_against(moment, of_moment)}."
        )
    left, floor = remaining.linear_residual_N, remaining.noise_floor_N
    with_them = " with the causes" if figures.effects else ""
    text = f"On held-out stretches the force error is {newtons(left)}{with_them}"
    if left > MORE * floor:
        text += f", {times(left / floor)} times the {newtons(floor)} of a recording without faults."
    else:
        text += f"; a recording without faults would have about {newtons(floor)}."
    turning = gain.get("held_out_angular_residual_Nm")
    return text if turning is None else f"{text} The moment error is {moment_Nm(turning.after)}."


def _against(said: str, ratio: float) -> str:
    return (
        f"{said}, {times(ratio)} times what is ordinary" if ratio > WITHIN else f"{said}, which is ordinary"
    )


def _nothing_else(figures: DiagnosisReport) -> str:
    remaining = figures.remaining
    if is_whole(figures):
        within = remaining.linear_residual_N <= MORE * remaining.noise_floor_N
        much = "That is ordinary there." if within else "That may still be ordinary there."
        return f"{much} Nothing else stands out."
    if now_and_then(figures):
        return "Away from the frames named above, nothing else stands out."
    rest = "No further cause and no single place on the body accounts for the difference"
    return (
        f"{rest}; a belt's motion that cannot be predicted may be in it."
        if speeds_up(figures)
        else f"{rest}."
    )
