"""1. From a subject to a plot in ten lines: both knees' torques over a walk."""

import matplotlib.pyplot as plt

from addb_viewer import Subject

subject = Subject.demo("demo_subject")  # made up; your own: Subject.open("FOLDER") or ("FILE.b3d")
walk = subject.fit(progress=True)["walk"]
plt.plot(walk.times, walk.torques["knee_angle_r"], label="right")
plt.plot(walk.times, walk.torques["knee_angle_l"], label="left")
plt.xlabel("time [s]")
plt.ylabel("knee torque [N·m]")
plt.legend()
plt.show()
