"""What the files say by themselves, before any cause is looked for and without a model of the body."""

from addb_viewer.text.sections import Section
from solver.diagnosis.diagnosis_report import DiagnosisReport, DirectCheck

HEADING = "What the files show without a body model"
ABOUT = {
    "entered_mass": "the entered mass, or another person",
    "load": "a load, or an object on a plate",
    "off_plate": "a foot beside the plates",
    "clock": "the clocks of forces and markers",
    "filter": "a filter of the forces",
    "plate_sign": "a plate's sign",
    "plate_zero": "a plate's zero level",
    "plate_scale": "a plate's scale",
    "plate_place": "a plate's place",
    "plate_turned_or_mirrored": "a plate that is turned or mirrored",
    "slip": "a marker that moved",
    "segment": "markers that moved together",
}
MOST_TOLD = 8  # more than anybody reads; the JSON has all
LOUD_NATS = 12.0  # from here on "strongly"


def what_the_files_say(figures: DiagnosisReport) -> Section:
    """Direct checks that speak for something being wrong, the clearest first; empty where none was asked."""
    asked = figures.direct_checks
    if not asked:
        return Section(HEADING)
    loud = sorted((w for w in asked if w.speaks_for), key=lambda w: -max(w.nats.values()))
    checks = f"{len(asked)} checks of forces and markers that need no body model"
    if not loud:
        return Section(HEADING, (f"{checks}: none shows a fault.",))
    left = len(loud) - MOST_TOLD
    more = f" The {MOST_TOLD} clearest of {len(loud)}:" if left > 0 else ""
    show = "one shows" if len(loud) == 1 else f"{len(loud)} show"
    rows = tuple((w.direct_check, _told(w, figures)) for w in loud[:MOST_TOLD])
    return Section(HEADING, (f"{checks}: {show} a fault.{more}",), rows)


def _told(statement: DirectCheck, figures: DiagnosisReport) -> str:
    several = len(figures.trials) > 1 and statement.trial
    place = f"{statement.trial}: " if several else ""
    classes = [ABOUT[about] for about in statement.speaks_for]
    how = "Points clearly to" if max(statement.nats.values()) >= LOUD_NATS else "Points to"
    return f"{place}{statement.sentence} {how} {', or '.join(classes)}."
