"""7. A release: load it, pick walking, plot the right knee's torque over the gait cycle of ten people.

Uses the folder `release`; where there is none it makes up people and builds one of them (a few minutes).
"""

import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import polars as pl

RELEASE, PEOPLE = Path("release"), 10
if not RELEASE.is_dir():
    for words in (
        "synthesize --subjects 16 --no-traps --out corpus",
        f"build corpus --out {RELEASE}",
    ):
        subprocess.run([sys.executable, "-m", "addb_viewer", "dataset", *words.split()], check=True)
FRAMES, COLUMNS = f"{RELEASE}/frames/*.parquet", ["trial_id", "frame", "tau_knee_angle_r"]

# the same five lines in four libraries; the last two are not needed for the picture
walking = pl.scan_parquet(FRAMES).filter((pl.col("activity") == "walk") & pl.col("counts"))
walking = walking.select(COLUMNS).collect()
print(f"Polars: {len(walking)} frames of walking")

import pyarrow.dataset as ds  # noqa: E402

chosen = (ds.field("activity") == "walk") & ds.field("counts")
table = ds.dataset(f"{RELEASE}/frames", format="parquet").to_table(columns=COLUMNS, filter=chosen)
print(f"PyArrow: {len(table)} frames")

try:
    import duckdb

    wanted = f"select {', '.join(COLUMNS)} from '{FRAMES}' where activity = 'walk' and counts"
    print(f"DuckDB: {len(duckdb.sql(wanted).fetchall())} frames")
except ImportError:
    print("DuckDB is not installed: pip install duckdb")

try:
    from datasets import load_dataset

    rows = load_dataset("parquet", data_files=FRAMES, split="train", columns=["activity", "counts", *COLUMNS])
    walks = rows.filter(
        lambda activity, counts: activity == "walk" and counts, input_columns=["activity", "counts"]
    )
    print(f"datasets: {len(walks)} frames")
except ImportError:
    print("datasets is not installed: pip install datasets")

# cycles: from a contact of the right foot to its next one, all frames counting
subjects = pl.read_parquet(RELEASE / "subjects.parquet").select("subject_id", "person_id", "mass_kg")
person_of = {row["subject_id"]: (row["person_id"], row["mass_kg"]) for row in subjects.to_dicts()}
contacts = pl.read_parquet(RELEASE / "contacts.parquet").filter(pl.col("foot") == "right")
cycles: dict[str, list[np.ndarray]] = {}
for (trial,), own in walking.group_by(["trial_id"], maintain_order=True):
    starts = contacts.filter(pl.col("trial_id") == trial)["start_frame"].sort().to_list()
    person, mass = person_of[trial.rsplit("/", 1)[0]]
    for start, end in pairwise(starts):
        inside = own.filter(pl.col("frame").is_between(start, end))
        if len(inside) == end - start + 1:
            share = np.linspace(start, end, 101)
            torque = np.interp(share, inside["frame"], inside["tau_knee_angle_r"])
            cycles.setdefault(person, []).append(torque / mass)

for person in list(cycles)[:PEOPLE]:
    plt.plot(np.arange(101), np.mean(cycles[person], axis=0), label=f"{person}, {len(cycles[person])} cycles")
plt.xlabel("gait cycle [%]")
plt.ylabel("torque of the right knee [N·m/kg]")
plt.legend()
plt.show()
