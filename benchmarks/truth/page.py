"""The page of the bench, made from its figures."""

import platform
from collections.abc import Mapping, Sequence
from datetime import date

from benchmarks.truth import tables
from benchmarks.truth.account import account
from benchmarks.truth.pooling import Run
from benchmarks.truth.ways import LABORATORY, OURS

PAGE = """# The bench of truth

{date}, Python {python}, code {version}. Made by `make bench-truth` ({minutes:.0f} minutes of CPU); the
figures are in `build/truth/*.json`. A change of the fit is judged here first, by residuals last.

{account}

## How to read it

Four ways from a recording to angles and torques, always in this order:

1. *ours*: the program's fit to markers and forces.
2. *marker fit*: ours without the fit to forces; motion and forces through the program's own 30 Hz filter.
3. *laboratory*: markers and forces through one filter (fourth order, no lag; 6 Hz in walking, squatting and
   sitting, 15 Hz in running, sprinting and jumping), inverse kinematics, inverse dynamics with the model's
   masses. Where the person's own scaled model is known, the laboratory takes it as it is.
4. *marker fit at its best*: motion and forces through one filter of 3 to 30 Hz, the one that is best by the
   truth, for each figure anew. Nobody can do that; it is what a better way has to beat.

Errors are root mean squares over legs and trunk (lumbar, hip, knee, ankle and subtalar coordinates), 0.1 s
at both ends of a trial left out; torques where all forces count. *ours / best*: our error over that of way 4,
for accelerations · torques; 1 or more means that the forces did not help. Percentages in brackets are of the
true peak. A lag is that of the cross-correlation; positive is late.

**Which model is used.** *own*: the person's own model, its masses up to 7 % wrong in part (b). The program
scales it anew and moves its markers (ways 1, 2 and 4); the laboratory takes it as it is. *default body*: none
given.

## (a) and (b): known truth

(a) *synthetic walk*: `synthetic_arnold2013_subject01`, made by others: their coordinates, their model,
torques by OpenSim's inverse dynamics (`id.sto`). Our inverse dynamics on the true motion under the recorded
forces is {referee} N·m from theirs: below that nothing is told. (b) `solver.simulate`: {persons} people an
activity. Skin movement is made by `benchmarks/truth/skin.py` from joint angles and impacts, root mean square
over all markers and frames, zero in the neutral pose; exact cameras besides, plates with a laboratory's noise
in (b).

{truth}

### Torques by joint, skin {skin:g} mm, own model

RMS N·m (share of the peak); peak; lag.

{torques}

### Accelerations by joint, skin {skin:g} mm, own model

RMS rad/s² (share of the peak); peak; lag.

{accelerations}

### Ranges of motion · peak speeds, own model

{ranges}

### Gain and phase, own model, first person

Against the unfiltered marker fit: cross-spectrum over its spectrum. In brackets the phase, positive where the
fit leads, and the marker fit's own RMS in the band [°]: where that is some hundredths, the gain is that of
noise. First ours, then what the truth itself would have.

{gains}

The truth against the marker fit:

{true_gains}

### Segments

Fitted over true mass; fitted less true length. One figure a person.

{segments}

## (c): real recordings

### Against others' angles

RMS °, each coordinate's mean difference taken off; ours / marker fit / laboratory. *An engine's* is
AddBiomechanics' or nimble's inverse kinematics, no expert's.

{references}

### Against others' torques

RMS N·m (share of the peak); peak; lag. No truth: inverse dynamics at the others' own filter.

{reference_torques}

### Ranges of motion · peak speeds against the recording's own markers

Ours against the marker fit, low-passed without lag at 6 Hz (walks), 10 Hz (runs, sprints, jumps) or 4 Hz
(squats, sitting). Masses: each part's share of the body, fitted over the scaled model's.

{own_markers}

### Gain and phase against the recording's own markers

{real_gains}

The laboratory's way:

{laboratory_gains}

### Twins: what gain is right

A gain below 1 may be motion that is lost or noise that is gone; the recording itself cannot tell. So each has
two matched synthetics whose motion is known (`matched_synthetics.py`): its gaps, forces that miss what
the real ones miss, and the bench's skin movement, as large and as fast on each segment as the fit finds the
recording's. The *calm* one moves as the reported fit does, under the recorded forces. The *lively* one moves
as the real marker fit does, far above the bands below: noise of the real markers counts as its motion. The
truth of the recording lies between them.

In each cell: the recording's gain; *right*: that of the synthetics' truth against their marker fits, calm and
lively; then our error in the band and that of the marker fit at the cut-off that is best for the band [°].

{matched_synthetic_gains}

Errors of whole trials; ours / unfiltered marker fit / marker fit at its best cut-off.

{matched_synthetics}

### Lengths against models scaled by hand

Ours less theirs, mm. *As described*: the model that the recording comes with, scaled by us.

{lengths}
{faults}"""


def page(cases: Sequence[Mapping], versions: Mapping[str, str]) -> str:
    """Everything as Markdown.

    Args:
        cases: as the files hold them.
        versions: of the code, by part.
    """
    known = [_named(run, case) for case in cases if case["part"] in KNOWN for run in case["runs"]]
    known.sort(key=_order)
    real = [
        run for case in cases if case["part"] in ("recorded", "matched_synthetics") for run in case["runs"]
    ]
    kinds = {
        kind: [r for r in real if r["kind"] == kind]
        for kind in ("own markers", "reference", "lengths", "matched_synthetic")
    }
    first = [r for r in known if r["model"] == "own" and r["person"] == 0 and r["skin_mm"] in (0.0, 5.0)]
    references = kinds["reference"]
    return PAGE.format(
        date=f"{date.today():%Y-%m-%d}",
        python=platform.python_version(),
        version=_versions(cases, versions),
        minutes=sum(case["cpu_seconds"] for case in cases) / 60,
        account=account(known, kinds["own markers"], references, kinds["matched_synthetic"]),
        referee=_referee(cases),
        persons=len({r["person"] for r in known if r["activity"] != "synthetic walk"}),
        skin=tables.DETAILED_SKIN_MM,
        truth=tables.truth_table(known),
        torques=tables.joint_table(known, "torque"),
        accelerations=tables.joint_table(known, "acceleration"),
        ranges=tables.range_table(known),
        gains=tables.gain_table(first, ("activity", "skin_mm"), OURS),
        true_gains=tables.gain_table(first, ("activity", "skin_mm"), "truth"),
        segments=tables.segment_table(known),
        references=tables.reference_table(references),
        reference_torques=tables.reference_torque_table(references),
        own_markers=tables.own_marker_table(kinds["own markers"]),
        real_gains=tables.gain_table(kinds["own markers"], ("recording", "trial"), OURS),
        laboratory_gains=tables.gain_table(kinds["own markers"], ("recording", "trial"), LABORATORY),
        matched_synthetic_gains=tables.matched_synthetic_gain_table(kinds["matched_synthetic"]),
        matched_synthetics=tables.matched_synthetic_table(kinds["matched_synthetic"]),
        lengths=tables.length_table(kinds["lengths"]),
        faults=_faults(cases),
    )


KNOWN = ("synthetic", "simulated")  # parts whose truth is known
ORDER = ("synthetic walk", "walk", "squat", "run", "sprint", "landing")


def _named(run: Mapping, case: Mapping) -> Run:
    return {**run, "activity": "synthetic walk"} if case["part"] == "synthetic" else run


def _order(run: Run) -> tuple:
    return ORDER.index(str(run["activity"])), run["model"] != "own", run["skin_mm"], run["person"]


def _referee(cases: Sequence[Mapping]) -> str:
    found = [run["referee_Nm"] for case in cases for run in case["runs"] if "referee_Nm" in run]
    return f"{found[0]:.2f}" if found else "(not measured)"


def _versions(cases: Sequence[Mapping], versions: Mapping[str, str]) -> str:
    """What the figures were made by: the solver as it is, or what else."""
    told = " and ".join(sorted(set(versions.values())))
    old = [case for case in cases if case["version"] != versions[case["part"]]]
    return f"{told} ({len(old)} of {len(cases)} files of figures are of other code)" if old else told


def _faults(cases: Sequence[Mapping]) -> str:
    lines = [f"- {case['part']} {case['of']}: {case['error']}" for case in cases if case["error"]]
    return "\n".join(["\n## Not measured\n", *lines, ""]) if lines else ""
