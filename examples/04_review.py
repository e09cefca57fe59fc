"""4. Review and fit again: a step found no plate; see what it costs to take its force for zero.

One step of the demo misses its plate, and nothing in the files says so. Detection leaves its frames out. You
have the last word: `flag` takes frames out, `clear` says that they count.
"""

import matplotlib.pyplot as plt
import numpy as np

from addb_viewer import Subject

subject = Subject.demo("demo_subject")
left_out = subject.fit()
print(left_out["walk"].proposals)
step = next(iter(left_out["walk"].proposals))

subject.clear("walk", step["start"], step["end"], foot=step["foot"], note="to see what it costs")
taken_for_zero = subject.fit()  # seconds: only the review has changed
subject.undo("walk")

subject.flag("walk", step["start"], step["end"], foot=step["foot"], reason="not over a plate")
print(subject.flags)
decided = subject.fit()
subject.undo("walk")  # so that the other examples find the demo as it was made

for name, fit in (("step taken for measured", taken_for_zero), ("step left out", decided)):
    walk = fit["walk"]
    size = np.linalg.norm(walk.residual_force, axis=1)
    plt.plot(walk.times, np.where(walk.used, size, np.nan), label=name)
plt.axvspan(*walk.times[[step["start"], step["end"] - 1]], alpha=0.2, label="the step")
plt.xlabel("time [s]")
plt.ylabel("force missing for F = ma [N]")
plt.legend()
plt.show()
