import platform
import subprocess
import sys

import psutil
import pytest

from solver.common.memory_release import release_memory


def held():
    return psutil.Process().memory_info().rss


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="the library's own matter elsewhere")
def test_what_lies_freed_below_something_that_stays_goes_back_to_the_system():
    lines = [bytes(2000) for _ in range(50_000)]
    stays = [bytes(2000) for _ in range(100)]
    del lines
    before = held()
    release_memory()

    assert len(stays) == 100
    assert before - held() > 50e6


FREED = """
import sys
from solver.common.memory_release import {what}
from benchmarks.speed.measuring import resident_megabytes
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


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="the library's own matter elsewhere")
@pytest.mark.parametrize(
    ("what", "size", "before", "after"),
    [("keep_little", 2**18, "keep_little()", ""), ("release_memory", 2**16, "", "release_memory()")],
)
def test_what_is_freed_goes_back(what, size, before, after):
    """Of 4000 arrays, nearly all, though others beside them stay."""
    program = FREED.format(what=what, size=size, before=before, after=after)
    given_back = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert float(given_back.stdout) > 0.9 * 4000 * size / 1e6
