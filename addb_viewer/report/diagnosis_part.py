"""The diagnosis: verdict, causes in words and figures, the recording without and with them, what remains."""

from collections.abc import Mapping

from addb_viewer.report.content import SubjectReport
from addb_viewer.report.markup import Safe, bar, element, joined, told
from addb_viewer.report.timeline import diagnosed_timeline
from addb_viewer.text.diagnosis_words import NOTES, page
from addb_viewer.text.extension_words import what_accepting_changes
from addb_viewer.text.holding_up_words import what_it_gains
from addb_viewer.text.residual_words import what_is_wrong
from solver.diagnosis.diagnosis import Gain
from solver.diagnosis.diagnosis_report import DiagnosisReport

BARS = (  # what, its key, unit, factor, decimals
    ("Force missed", "held_out_linear_residual_N", "N", 1.0, 0),
    ("Moment missed", "held_out_angular_residual_Nm", "N·m", 1.0, 1),
    ("Marker error", "marker_rms_m", "mm", 1e3, 1),
)


def diagnosis_part(report: SubjectReport) -> Safe:
    """All that a stored diagnosis says; or that there is none."""
    shown = report.diagnosis
    if shown.figures is None:
        return element("p", shown.absent)
    after: dict[str, list[Safe]] = {
        what_is_wrong(shown.figures).heading: _timelines(report, shown.figures),
        what_it_gains(shown.figures).heading: [gain_bars(shown.figures.gain)],
    }
    pieces: list[Safe] = []
    for section in page(shown.figures):
        if section.heading != NOTES:  # those stand among the report's own
            pieces += [told(section), *after.get(section.heading, ())]
    if shown.decision:
        pieces.append(element("p", shown.decision))
    if shown.gain is not None:
        pieces.append(told(what_accepting_changes(shown.gain)))
    return joined(pieces)


def gain_bars(gain: Mapping[str, Gain]) -> Safe:
    """Each figure on hidden stretches without and with the causes, as bars of a common scale."""
    groups = []
    for label, key, unit, factor, digits in BARS:
        if key not in gain:
            continue
        before, after = (factor * figure for figure in (gain[key].before, gain[key].after))
        most = max(before, after, 1e-12)
        bars = [
            element(
                "div",
                element("span", words),
                bar(v / most, kind),
                element("b", f"{v:.{digits}f} {unit}"),
            )
            for words, kind, v in (("without", "before", before), ("with", "after", after))
        ]
        groups.append(element("figure", element("figcaption", label), *bars))
    return element("div", *groups, class_="gains")


def _timelines(report: SubjectReport, figures: DiagnosisReport) -> list[Safe]:
    drawn: list[Safe] = []
    several = len(report.recording.trials) > 1
    for index, record in enumerate(report.recording.trials):
        chart = diagnosed_timeline(record, index, figures)
        if chart is not None:
            name = f"{record.replay.name}. " if several else ""
            beside = "without and with the named causes" if figures.effects else "against what is ordinary"
            words = f"{name}The recording's own residual over time, {beside}"
            drawn.append(element("figure", element("figcaption", words), chart))
    return drawn
