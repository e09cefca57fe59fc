"""What a fit is predicted to hold in memory, beside what it then holds; and how it is refused."""

import json
import subprocess
import sys
from dataclasses import replace

import pytest

from solver.capture.subject.opened_subject import open_subject
from solver.common import operating_system
from solver.common.errors import FitError
from solver.dynamics import memory
from solver.dynamics.memory import TrialSize, needed_bytes, refuse_what_does_not_fit
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings
from solver.skeleton.osim import load_skeleton

FOLDER = "walk_treadmill_stepwidth"
FRAMES = 501  # of its trial
SCRIPT = """
import json, resource, sys
from dataclasses import replace
from pathlib import Path
import psutil
from solver.capture.subject.opened_subject import open_subject
from solver.dynamics.memory import needed_bytes, sizes_of
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings

plain = Settings()  # a round is enough, all rounds hold the same
once = replace(plain, trajectory=replace(plain.trajectory, iterations=1, held_out=False))
told = {}

def before(skeleton, captures):
    told["predicted"] = needed_bytes(sizes_of(captures), skeleton, once.trajectory)
    told["before"] = psutil.Process().memory_info().rss

solve(open_subject(Path(sys.argv[1])), once, before_fitting=before)
status = Path("/proc/self/status")  # a process inherits getrusage's peak from the one that started it
if status.exists():
    (line,) = (line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
    told["peak"] = 1024 * int(line.split()[1])
else:
    told["peak"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(json.dumps(told))
"""

pytestmark = pytest.mark.real


def lengthened(source, folder, times):
    """The trial forth and back, so that nothing jumps."""
    (folder / "example1").mkdir(parents=True)
    order = [i if i < FRAMES else 2 * FRAMES - 1 - i for i in range(2 * FRAMES)]
    order = [order[i % (2 * FRAMES)] for i in range(times * FRAMES)]
    for file in ("subject.toml", "unscaled_generic_32markers.osim"):
        (folder / file).write_bytes((source / file).read_bytes())
    lines = (source / "example1/markers.trc").read_text().splitlines()
    rows = [line.split("\t", 2)[2] for line in lines if line.split("\t")[0].isdigit() and "." in line][
        -FRAMES:
    ]
    titles = lines[2].split("\t")
    titles[2] = str(len(order))
    body = [f"{i + 1}\t{i / 100:.2f}\t{rows[k]}" for i, k in enumerate(order)]
    text = [*lines[:2], "\t".join(titles), *lines[3:5], *body]
    (folder / "example1/markers.trc").write_text("\n".join(text) + "\n")
    lines = (source / "example1/grf.mot").read_text().splitlines()
    head = lines.index("endheader") + 2
    rows = [line.split("\t", 1)[1] for line in lines[head : head + FRAMES]]
    body = [f"{i / 100:.2f}\t{rows[k]}" for i, k in enumerate(order)]
    text = [line if not line.startswith("nRows") else f"nRows={len(order)}" for line in lines[:head]]
    (folder / "example1/grf.mot").write_text("\n".join([*text, *body]) + "\n")
    return folder


@pytest.fixture(scope="module")
def measured(real_data, tmp_path_factory):
    """Bytes predicted and held by fits of 10 and of 20 seconds."""
    told = []
    for times in (2, 4):
        folder = lengthened(real_data / FOLDER, tmp_path_factory.mktemp("long") / FOLDER, times)
        command = [sys.executable, "-c", SCRIPT, str(folder)]
        ran = subprocess.run(command, capture_output=True, text=True, check=False)
        assert ran.returncode == 0, ran.stderr
        told.append(json.loads(ran.stdout))
    return told


@pytest.mark.slow
def test_what_is_predicted_is_what_is_held(measured):
    for told in measured:
        held = told["peak"] - told["before"]
        assert held < told["predicted"] < 1.5 * held, measured


@pytest.mark.slow
def test_it_grows_as_it_does(measured):
    short, long = measured
    held = (long["peak"] - short["peak"]) / (long["predicted"] - short["predicted"])
    assert 0.7 < held < 1.0, measured


def test_a_recording_too_long_is_refused_before_the_fit(real_data, monkeypatch):
    """70 seconds at 100 Hz on a machine with 0.5 GB free, by its size alone."""
    monkeypatch.setattr(memory, "available_bytes", lambda: 5 * 10**8)
    skeleton = load_skeleton(real_data / FOLDER / "unscaled_generic_32markers.osim")
    size = TrialSize("walk", 7000, 100.0, forces=True)
    with pytest.raises(
        FitError, match=r"^walk: 7000 frames at 100 Hz: .*needs about \d\.\d GB .*0\.5 GB are"
    ):
        refuse_what_does_not_fit([size], skeleton, TrajectorySettings())
    refuse_what_does_not_fit([size], skeleton, TrajectorySettings(knot_spacing_s=0.04))
    ten = [replace(size, name=f"walk{i}", frames=700) for i in range(10)]
    with pytest.raises(FitError, match="--trial NAME"):
        refuse_what_does_not_fit(ten, skeleton, TrajectorySettings())
    refuse_what_does_not_fit(ten[:1], skeleton, TrajectorySettings())


def test_fourteen_times_as_long_needs_little_more(real_data):
    """Beyond the border, what is worked out at a time stays the same; what is kept grows."""
    skeleton = load_skeleton(real_data / FOLDER / "unscaled_generic_32markers.osim")
    border, long = (
        needed_bytes([TrialSize("walk", frames, 100.0, forces=True)], skeleton, TrajectorySettings())
        for frames in (7000, 100_000)
    )
    assert long < 1.6e9
    assert long < 2 * border


def test_a_solve_asks_before_it_begins(real_data, monkeypatch):
    monkeypatch.setattr(memory, "available_bytes", lambda: 10**7)
    stages = []
    with pytest.raises(FitError, match=r"^example1: 501 frames at 100 Hz: .*are free"):
        solve(open_subject(real_data / FOLDER), Settings(), progress=lambda stage, _: stages.append(stage))
    assert stages == ["reading example1"]


def test_a_limit_of_the_process_counts():
    """As `ulimit -v` sets it."""
    script = (
        "import resource, psutil; from solver.common.operating_system import available_bytes; "
        "most = psutil.Process().memory_info().vms + 10**9; "
        "resource.setrlimit(resource.RLIMIT_AS, (most, most)); print(available_bytes())"
    )
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert 0.9e9 < int(ran.stdout) <= 1e9


@pytest.mark.parametrize(
    ("line", "files"),
    [
        ("0::/job", ("memory.max", "memory.current")),
        ("4:cpu,memory:/job", ("memory.limit_in_bytes", "memory.usage_in_bytes")),
    ],
    ids=["version 2", "version 1"],
)
@pytest.mark.parametrize("place", ["job", "."], ids=["its own group", "in a container"])
def test_a_control_group_counts(tmp_path, monkeypatch, line, files, place):
    limit, used = files
    root = tmp_path / "memory" if "cpu" in line else tmp_path
    (root / place).mkdir(parents=True, exist_ok=True)
    (tmp_path / "cgroup").write_text(f"1:name=systemd:/\n{line}\n")
    (root / place / limit).write_text(f"{3 * 2**30}\n")
    (root / place / used).write_text(f"{2**30}\n")
    (root / place / "memory.stat").write_text(f"anon 5\ninactive_file {2**20}\n")
    monkeypatch.setattr(operating_system, "CGROUPS", tmp_path)
    monkeypatch.setattr(operating_system, "OWN_GROUPS", tmp_path / "cgroup")
    assert operating_system._group_bytes() == 2 * 2**30 + 2**20
