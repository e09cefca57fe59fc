"""What accepting the named causes changes, as a section for people."""

from collections.abc import Sequence

from addb_viewer.text.coordinate_words import torque_in_words
from addb_viewer.text.diagnosis_vocabulary import amounts, listed, title
from addb_viewer.text.holding_up_words import before_and_after
from addb_viewer.text.sections import Section
from solver.diagnosis.diagnosis_report import AcceptedCause, AcceptedGain, Cause, TorqueChanges

LEAST_KG = 0.05  # of a mass that changes
CHANCE = "There are too few held-out blocks to tell whether that is chance."


def what_accepting_changes(told: AcceptedGain) -> Section:
    """The trajectory fit without and with the causes: held-out forces, markers, mass, joint torques."""
    mass = told.mass_kg
    rows = [
        (label, before_and_after(gain, unit, factor, digits))
        for label, gain, unit, factor, digits in (
            ("force", told.held_out_linear_residual_N, "N", 1.0, 0),
            ("moment", told.held_out_angular_residual_Nm, "N·m", 1.0, 1),
            ("markers", told.marker_rms_m, "mm", 1e3, 1),
            ("body mass", mass if mass and abs(mass.after - mass.before) >= LEAST_KG else None, "kg", 1.0, 1),
        )
        if gain is not None
    ]
    if told.joint_torque_change is not None:
        rows.append(("joint torques", _torques(told.joint_torque_change)))
    rows.append(("causes", _causes(told.causes)))
    return Section("What accepting changes", (_how(told), *told.notes), tuple(r for r in rows if r[1]))


def _how(told: AcceptedGain) -> str:
    blocks = told.held_out_blocks
    if not blocks:
        return (
            "Trajectories fitted to markers and forces without → with the causes. Too few frames have forces "
            "to hold out any."
        )
    drops = [told.held_out_linear_drop_N, told.held_out_angular_drop_Nm]
    text = (
        f"Trajectories fitted to markers and forces without → with the causes. Forces and moments are those "
        f"on {told.held_out_frames} frames in {blocks} blocks held out from both fits; for joint "
        f"torques the root mean square of their change is given, in brackets as a share of the torque itself."
    )
    if drops[0] is None:
        return f"{text} {CHANCE}"
    names = ("force", "moment")
    surely = [n for n, drop in zip(names, drops, strict=True) if drop is not None and drop[0] > 0]
    worse = [n for n, drop in zip(names, drops, strict=True) if drop is not None and drop[1] < 0]
    if surely:
        text += f" Falls, more than by chance: the residual {listed(surely)}."
    if worse:
        text += f" Rises, more than by chance: the residual {listed(worse)}. Reconsider accepting."
    if not surely and not worse:
        text += " On these the gain is not certain."
    return text


def _causes(causes: Sequence[AcceptedCause]) -> str:
    """As this fit found them."""
    found = [Cause(cause.id, cause.target, cause.parameters, 1.0, ()) for cause in causes]
    return "; ".join(f"{title(cause)}: {', '.join(amounts(cause))}" for cause in found if amounts(cause))


def _torques(change: TorqueChanges) -> str:
    """Those that change most: root mean square of the change, against that of the torque itself."""
    said = []
    for dof in change.most_changed:
        by, of = change.rms[dof], change.before_rms[dof]
        share = f" ({100 * by / of:.0f} %)" if of else ""
        said.append(f"{torque_in_words(dof).removesuffix(' torque')} by {by:.1f} N·m{share}")
    return "; ".join(said)
