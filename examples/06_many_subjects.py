"""6. Many subjects: fit each, keep a line a trial, hand over a report and files for OpenSim.

One that cannot be used stops nothing. `addb-viewer fit ROOT --jobs 2` does several at a time.
"""

from pathlib import Path

from addb_viewer import SolverError, Subject

ROOT = Path()  # of your own: the folder that holds the subjects' folders
Subject.demo(ROOT / "demo_subject")
(ROOT / "empty_subject").mkdir(exist_ok=True)

print("subject, trial, frames used, marker RMS [cm], residual force [BW]")
for folder in sorted(path for path in ROOT.iterdir() if path.name.endswith("_subject")):
    try:
        fit = Subject.open(folder).fit()
    except SolverError as error:
        print(f"{folder.name}: left out: {error}")
        continue
    for figures in fit.figures["trials"]:
        marker_cm = 100 * figures["marker_rms_m"]
        force = figures["linear_residual"]["rms_BW"]
        used = f"{figures['frames_with_force_used']} of {figures['frames']}"
        print(f"{folder.name}, {figures['name']}, {used}, {marker_cm:.2f}, {force:.4f}")
    print(f"  {fit.report()}")
    print(f"  {fit.export('opensim')[0].parent}")
