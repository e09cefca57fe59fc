"""What a recording with this diagnosis is good for, in one line."""

from collections.abc import Sequence

from addb_viewer.text.detectable_words import cannot_tell
from addb_viewer.text.diagnosis_vocabulary import (
    CONFIDENT,
    about,
    listed,
    names_of,
    rivals_of,
    target_in_words,
    trials_of_causes,
)
from addb_viewer.text.gain_words import is_tentative, now_and_then
from addb_viewer.text.note_words import by_kind
from addb_viewer.text.residual_words import corrected_causes, corrected_on_reading, is_whole, nothing_corrects
from solver.common.notes import Kind
from solver.diagnosis.causes.about import CorrectedBy
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport


def use(figures: DiagnosisReport) -> str:
    """Whether to use the recording as it is, and for what; of several trials, which."""
    concerned = trials_in_question(figures)
    others = [trial for trial in figures.trials if trial not in concerned]
    whole = f"{listed(others)} as it is. {listed(concerned)}: " if others else ""
    return f"Use: {whole}{_use(figures)}{_doubted_angles(figures)}"


def trials_in_question(figures: DiagnosisReport) -> list[str]:
    """Trials that the causes act on, where that is all there is; else all."""
    concerned = trials_of_causes(figures)
    told = figures.verdict == "explained" and is_whole(figures) and not is_tentative(figures)
    soft_tissue = any(map(nothing_corrects, figures.effects))  # slides in every trial
    return concerned if concerned and told and not soft_tissue else list(figures.trials)


def _doubted_angles(figures: DiagnosisReport) -> str:
    """Markers that the fit hardly followed, or lacked, which no verdict on the forces tells."""
    near = "Joint angles near them may be wrong; the notes say in which frames."
    said = ""
    for of_kind in by_kind(figures.notes):
        if of_kind.kind is Kind.FAR_MARKERS:
            said += f" But there are {of_kind.key_findings} {near}"
        elif of_kind.kind is Kind.PELVIS:
            said += f" But there is {of_kind.key_findings}."
    return said


def _use(figures: DiagnosisReport) -> str:
    if figures.verdict == "clean":
        below = "smaller faults may be there, see below. Whether its errors are within limits, the fit says."
        blind = cannot_tell(figures)
        but = f", but it cannot show {listed(blind)}" if blind else ""
        return f"no fault that was found speaks against angles and torques{but}; {below}"
    if figures.verdict != "explained":
        rest = "what remains" if figures.effects else "the cause"
        return (
            f"not for joint torques, before {rest} is understood; for joint angles with care, since the "
            "motion may be at fault as well."
        )
    if corrected_causes(figures):
        return (
            "as it is, since this program corrects the fault when it reads the files. The fault is still in "
            "the files: correct them for other programs."
        )
    if not names_of(figures):
        return (
            "for joint angles as it is; for joint torques with care, before somebody has looked whether it "
            "is what the tentative cause says."
        )
    left = [effect for effect in names_of(figures) if not corrected_on_reading(effect)]
    of_markers = _near_markers([effect for effect in left if about(effect).in_markers])
    of_forces = [effect for effect in left if not about(effect).in_markers]
    if not of_forces:
        return f"{of_markers}; else as it is."
    rest = _of_forces(figures, of_forces)
    return f"{of_markers}; else {rest}" if of_markers else rest


def _near_markers(effects: Sequence[Cause]) -> str:
    """What faults of markers leave of the joints beside them; empty where there are none."""
    soft_tissue = [target_in_words(effect.target) for effect in effects if nothing_corrects(effect)]
    said = []
    if soft_tissue:
        said.append(
            f"not for angles and torques of the joints at the {listed(soft_tissue)}: this cannot be "
            "corrected later"
        )
    labels = [label for e in effects if not nothing_corrects(e) for label in e.target.split("+")]
    if labels:
        near = f"for angles and torques of the joints near {listed(labels)}"
        corrected = "this marker is corrected" if len(labels) == 1 else "these markers are corrected"
        said.append(f"{near} only once {corrected}")
    return "; ".join(said)


def _of_forces(figures: DiagnosisReport, effects: Sequence[Cause]) -> str:
    if all(about(effect).corrected_by is CorrectedBy.FLAGGED for effect in effects):
        return "outside the frames named below; flag these first."
    doubted = any(about(effect).doubts_angles for effect in effects)
    angles = "" if doubted else "for joint angles as it is; "
    rest_of = [effect for effect in effects if about(effect).corrected_by is not CorrectedBy.FLAGGED]
    if len(rest_of) < len(effects):
        angles += "never for joint torques in the frames of the unmeasured step; elsewhere "
    if any(_other_causes(figures, effect) for effect in rest_of):
        return f"{angles}not for joint torques, before it is known which cause it is."
    causes = "the cause" if len(rest_of) == 1 else "the causes"
    whole = is_whole(figures) or now_and_then(figures)  # a step's own force no hidden stretch predicts
    rest = "" if whole else ", and then with care, since not all is explained (see what remains)"
    return f"{angles}for joint torques only with {causes} corrected (`addb-viewer accept`){rest}."


def _other_causes(figures: DiagnosisReport, effect: Cause) -> bool:
    """Whether something of another kind may be in a cause's place; another place of the same is no matter."""
    unsure = effect.confidence < CONFIDENT
    return unsure and any(rival.id != effect.id for rival in rivals_of(figures, effect))
