"""Memory that is free goes back to the system."""

import os
import subprocess
import sys

import pytest

FREED = """
import sys
from addb_viewer.app.subjects.memory import {what}
from benchmarks.processes import resident_megabytes
import os, numpy as np
{before}
np.ones({size})  # freed at once: from then on C's library keeps arrays of such a size, if it may
kept, gone = [], []
for k in range(4000):
    gone.append(np.ones({size} // 8))
    kept.append(np.ones(8))  # beside it, so that the heap cannot end there
full = resident_megabytes(os.getpid())
del gone
{after}
print(full - resident_megabytes(os.getpid()))
"""


@pytest.mark.skipif(not os.confstr("CS_GNU_LIBC_VERSION"), reason="C's library is not glibc")
@pytest.mark.parametrize(
    ("what", "size", "before", "after"),
    [("keep_little", 2**18, "keep_little()", ""), ("_trim", 2**16, "", "_trim()")],
)
def test_what_is_freed_goes_back(what, size, before, after):
    """Of 4000 arrays, nearly all, though others beside them stay."""
    program = FREED.format(what=what, size=size, before=before, after=after)
    given_back = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert float(given_back.stdout) > 0.9 * 4000 * size / 1e6
