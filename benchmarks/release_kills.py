"""Kill a build of a release at seeded times, let it go on, and compare its bytes with an undisturbed one.

    python -m benchmarks.release_kills [ROOT] --out FOLDER [--kills 10] [--seed 0] [--workers 1]

Workers and client are killed in turns, by signal 9. Afterwards the same is built with one worker more, and
once more with one subject's mass changed. ROOT has subjects of any kind; small ones will do. Without it three
are made. FOLDER/kills.json has what came out of each build: stopped at any time, the same words go on. Where
FOLDER is DIR/kills, `release_cost --folder DIR --page` tells it. Exit status 1 where a byte differs.
"""

import argparse
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import psutil

from addb_viewer.dataset.synthesis.corpus import CorpusOptions, synthesize
from solver.capture.atomic import write_whole

TERMS = ("--licence", "CC0-1.0", "--consent", "public", "--unreviewed")
NOT_HASHED = {"build_log.json"}
FIGURES = "kills.json"
MADE = CorpusOptions(
    3, seed=2, traps=False, actors=1, activities=("walk",), longest_s=1.0, faults=False
)  # small enough for many builds
AGAIN = 3  # times that a killed build is started once more
POLL_S = 0.01


@dataclass(frozen=True)
class Kill:
    """A build that was killed once."""

    victim: str  # worker or client
    after_s: float
    happened: bool  # False: the build had ended
    same: bool  # bytes as undisturbed, once it was started again


@dataclass(frozen=True)
class Kills:
    """What came out so far."""

    subjects: int
    files: int
    undisturbed_s: float
    workers: int
    kills: tuple[Kill, ...] = ()
    one_more_worker_same: bool | None = None
    again: int | None = None  # subjects that were done again when one had changed
    others_same: bool | None = None  # the files of all other subjects

    @property
    def right(self) -> bool:
        """Whether all is as it should be."""
        changed = self.again in (None, 1) and self.others_same in (None, True)
        return all(kill.same for kill in self.kills) and self.one_more_worker_same is not False and changed


def main() -> int:
    """Run what is not there yet."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("root", type=Path, nargs="?")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=1)
    asked = parser.parse_args()
    root = asked.root or asked.out / "made"
    if not root.is_dir():
        synthesize(root, MADE)
    found = kept(asked.out) or _kept(asked.out, _undisturbed(root, asked.out, asked.workers))
    draw = random.Random(asked.seed)
    for number in range(asked.kills):
        after = draw.uniform(0.05, 0.95) * found.undisturbed_s
        if number < len(found.kills):
            continue
        kill = _kill(root, asked.out, "client" if number % 2 else "worker", after, asked.workers)
        found = _kept(asked.out, replace(found, kills=(*found.kills, kill)))
    if found.one_more_worker_same is None:
        out = _fresh(asked.out / "more_workers")
        _started(root, out, asked.workers + 1).wait()
        same = contents(out) == contents(_whole(asked.out))
        found = _kept(asked.out, replace(found, one_more_worker_same=same))
    if found.again is None:
        again, same = _changed(root, asked.out, asked.workers)
        found = _kept(asked.out, replace(found, again=again, others_same=same))
    return int(not found.right)


def kept(folder: Path) -> Kills | None:
    """What came out; None where nothing was built yet."""
    path = folder / FIGURES
    if not path.is_file():
        return None
    told = json.loads(path.read_text(encoding="utf-8"))
    return Kills(**{**told, "kills": tuple(Kill(**one) for one in told["kills"])})


def _kept(folder: Path, found: Kills) -> Kills:
    write_whole(folder / FIGURES, json.dumps(asdict(found), indent=1))
    last = found.kills[-1] if found.kills else None
    print(last if found.one_more_worker_same is None and last else found, flush=True)
    return found


def contents(release: Path) -> dict[str, str]:
    """SHA-256 of every hashed file, as the manifest tells them, and the manifest itself."""
    if not (release / "manifest.json").is_file():
        return {}
    text = (release / "manifest.json").read_text(encoding="utf-8")
    lying = {p.relative_to(release).as_posix() for p in release.rglob("*") if p.is_file()} - NOT_HASHED
    told = json.loads(text)["files"]
    hashes = {path: one["sha256"] for path, one in told.items()}
    return hashes | {"manifest.json": text, "lying": " ".join(sorted(lying))}


def _whole(out: Path) -> Path:
    return out / "undisturbed" / "release"


def _fresh(place: Path) -> Path:
    shutil.rmtree(place, ignore_errors=True)
    return place / "release"


def _undisturbed(root: Path, out: Path, workers: int) -> Kills:
    whole = _fresh(_whole(out).parent)
    began = time.monotonic()
    if _started(root, whole, workers).wait():
        raise SystemExit(f"{root}: no release can be built of it")
    lasts = time.monotonic() - began
    subjects = len(json.loads((whole / "manifest.json").read_text(encoding="utf-8"))["subjects"])
    return Kills(subjects, len(contents(whole)), lasts, workers)


def _kill(root: Path, folder: Path, victim: str, after: float, workers: int) -> Kill:
    out = _fresh(folder / "killed")
    client = _started(root, out, workers)
    happened = _killed(client, victim, after)
    client.wait()
    for _ in range(AGAIN):
        if not client.returncode:
            break
        client = _started(root, out, workers)
        client.wait()
    return Kill(victim, after, happened, contents(out) == contents(_whole(folder)))


def _changed(root: Path, folder: Path, workers: int) -> tuple[int, bool]:
    """How many subjects are done again when one's mass changes; whether the others' files stay."""
    changed, out = folder / "changed" / root.name, _whole(folder)
    shutil.rmtree(changed.parent, ignore_errors=True)
    shutil.copytree(root, changed)
    kept_work = out.with_name(f"{out.name}.work")
    work = _fresh(folder / "again")
    shutil.copytree(kept_work, work.with_name(kept_work.name))
    before = set(work.with_name(kept_work.name).glob("*/receipt.json"))
    file = min(changed.rglob("subject.toml"))
    text, count = re.subn(
        r"(?m)^mass_kg = ([\d.]+)", lambda m: f"mass_kg = {float(m[1]) + 1}", file.read_text(encoding="utf-8")
    )
    if count != 1:
        raise SystemExit(f"{file}: names no mass_kg, so it cannot be changed")
    file.write_text(text, encoding="utf-8")
    times = {path: path.stat().st_mtime_ns for path in before}
    _started(changed, work, workers).wait()
    after = set(work.with_name(kept_work.name).glob("*/receipt.json"))
    again = [path for path in after if times.get(path) != path.stat().st_mtime_ns]
    ours = {path: digest for path, digest in contents(work).items() if "/" in path}
    theirs = contents(out)
    other = {Path(path).name.split(".")[0] for path, digest in ours.items() if theirs.get(path) != digest}
    return len(again), len(other) == 1


def _started(root: Path, out: Path, workers: int) -> subprocess.Popen[bytes]:
    out.parent.mkdir(parents=True, exist_ok=True)
    words = [sys.executable, "-m", "addb_viewer", "dataset", "build", str(root), "--out", str(out), *TERMS]
    return subprocess.Popen([*words, "--workers", str(workers)], stdout=subprocess.DEVNULL)


def _killed(client: subprocess.Popen[bytes], victim: str, after: float) -> bool:
    """Kill it then; a worker that is not there yet is waited for."""
    time.sleep(after)
    while client.poll() is None:
        with suppress(psutil.Error):
            workers = [
                one
                for one in psutil.Process(client.pid).children(recursive=True)
                if any("subject_task" in word for word in one.cmdline())
            ]
            if victim == "client":
                client.send_signal(signal.SIGKILL)
                psutil.wait_procs(workers, timeout=30)
                return True
            if workers:
                os.kill(workers[0].pid, signal.SIGKILL)
                return True
        time.sleep(POLL_S)
    return False


if __name__ == "__main__":
    sys.exit(main())
