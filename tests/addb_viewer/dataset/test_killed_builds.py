"""A small corpus: its traps end as truth says, and builds that were killed give the undisturbed one's bytes.

The undisturbed release is made in this process; the killed one by the command, two workers at a time.
"""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress

import psutil
import pyarrow.parquet as pq
import pytest

from addb_viewer.dataset.build import build, planned
from addb_viewer.dataset.release_subject import BuildOptions
from addb_viewer.dataset.synthesis.corpus import CorpusOptions, synthesize, truth_folder
from tests.addb_viewer.dataset.builds import Here

SMALL = CorpusOptions(3, seed=2, actors=1, activities=("walk",), longest_s=1.0)
QUICK = "[trajectory]\nheld_out = false\n\n[prediction]\nenabled = false\n"
AT_MOST_S = 300.0  # so that a build that hangs does not hold up the tests


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    place = tmp_path_factory.mktemp("made") / "corpus"
    synthesize(place, SMALL)
    for folder in place.glob("*/*"):
        (folder / "settings.toml").write_text(QUICK, encoding="utf-8")
    return place


@pytest.fixture(scope="module")
def undisturbed(root, tmp_path_factory):
    out = tmp_path_factory.mktemp("undisturbed") / "release"
    build(planned([root], BuildOptions()), out, BuildOptions(), Here())
    return out


def started(root, out, workers):
    words = [sys.executable, "-m", "addb_viewer", "dataset", "build", str(root), "--out", str(out)]
    return subprocess.Popen([*words, "--workers", str(workers)], stdout=subprocess.DEVNULL)


def receipts(out):
    return list(out.with_name(f"{out.name}.work").glob("*/receipt.json"))


def workers_of(client):
    with suppress(psutil.Error):
        return [
            child
            for child in psutil.Process(client.pid).children(recursive=True)
            if any("subject_task" in word for word in child.cmdline())
        ]
    return []


def waited_for(happened):
    began = time.monotonic()
    while not (found := happened()):
        assert time.monotonic() - began < AT_MOST_S
        time.sleep(0.02)
    return found


def contents(release):
    return {
        path.relative_to(release).as_posix(): path.read_bytes()
        for path in sorted(release.rglob("*"))
        if path.is_file() and path.name != "build_log.json"
    }


@pytest.mark.slow
def test_every_trap_ends_where_truth_says_and_nothing_else_is_left_out(root, undisturbed):
    truth = json.loads((truth_folder(root) / "truth.json").read_text(encoding="utf-8"))
    said = sorted((row["level"], row["id"], row["reason"]) for row in truth["left_out"])
    told = pq.read_table(undisturbed / "left_out.parquet").to_pylist()
    assert sorted((row["level"], row["id"], row["reason"]) for row in told) == said
    good = {one["subject_id"] for one in truth["subjects"] if one["trap"] is None}
    assert set(pq.read_table(undisturbed / "subjects.parquet")["subject_id"].to_pylist()) == good


@pytest.mark.slow
def test_a_killed_worker_and_a_killed_client_cost_no_subject_and_change_no_byte(root, undisturbed, tmp_path):
    out = tmp_path / "release"
    client = started(root, out, 2)
    os.kill(waited_for(lambda: workers_of(client))[0].pid, signal.SIGKILL)
    waited_for(lambda: receipts(out) and workers_of(client))
    workers = workers_of(client)
    client.send_signal(signal.SIGKILL)
    client.wait()
    psutil.wait_procs(workers, AT_MOST_S)
    assert not any(worker.is_running() for worker in workers)
    done = {path: path.stat().st_mtime_ns for path in receipts(out)}
    assert done
    assert not out.exists()
    assert started(root, out, 2).wait(AT_MOST_S) == 0
    assert {path: path.stat().st_mtime_ns for path in done} == done  # done once
    assert contents(out) == contents(undisturbed)
    assert "worker_died" not in pq.read_table(out / "left_out.parquet")["reason"].to_pylist()
