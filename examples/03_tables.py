"""3. Results as tables: gait cycles, and the work that each joint does, with Polars.

`to_pandas()` in place of `to_polars()` gives pandas frames.
"""

import numpy as np
import polars as pl

from addb_viewer import Subject

fit = Subject.demo("demo_subject").fit()
print(fit.cycles.to_polars().select("foot", "contact_s", "stride_length_m", "cadence_per_min", "speed_m_s"))

walk = fit["walk"]
joints = ("hip_flexion", "knee_angle", "ankle_angle")
powers = walk.powers.to_polars().filter(pl.Series(walk.used))  # frames whose forces were measured
work = (
    powers.select(pl.col(f"{joint}_{side}_W").clip(0.0) for joint in joints for side in "rl").sum()
    / walk.rate
)
print("positive work [J] on these frames:")
print(work.unpivot(variable_name="joint", value_name="work_J").sort("work_J", descending=True))

frames = walk.to_polars()  # all that has one value a frame
frames.write_parquet("walk.parquet")
print(f"walk.parquet: {frames.height} rows, {frames.width} columns")
print(f"centre of mass between {np.ptp(walk.com['y']) * 100:.1f} cm up and down")
