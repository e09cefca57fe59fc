"""Kill a build of a release at seeded times, let it go on, and compare its bytes with an undisturbed one.

    python -m benchmarks.release_kills ROOT --out FOLDER [--kills 10] [--seed 0] [--workers 1]

Workers and client are killed in turns, by signal 9. ROOT has subjects of any kind; small ones will do. Prints
a line a kill; exit status 1 where a byte differs.
"""

import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import psutil

TERMS = ("--licence", "CC0-1.0", "--consent", "public", "--unreviewed")
NOT_HASHED = {"build_log.json"}


def main() -> int:
    """Run all kills."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("root", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=1)
    asked = parser.parse_args()
    draw = random.Random(asked.seed)
    whole = asked.out / "undisturbed" / "release"
    began = time.monotonic()
    _started(asked.root, whole, asked.workers).wait()
    lasts = time.monotonic() - began
    print(f"undisturbed: {lasts:.0f} s, {len(contents(whole))} files", flush=True)
    wrong = 0
    for kill in range(asked.kills):
        victim = "client" if kill % 2 else "worker"
        after = draw.uniform(0.05, 0.95) * lasts
        out = asked.out / f"kill_{kill}" / "release"
        shutil.rmtree(out.parent, ignore_errors=True)
        client = _started(asked.root, out, asked.workers)
        killed = _killed(client, victim, after)
        client.wait()
        again = 0
        while client.returncode and again < 3:
            client = _started(asked.root, out, asked.workers)
            client.wait()
            again += 1
        same = contents(out) == contents(whole)
        wrong += not same
        print(
            f"{kill}: {victim} after {after:.1f} s, {killed}; {'same bytes' if same else 'OTHER BYTES'}",
            flush=True,
        )
        shutil.rmtree(out.parent, ignore_errors=True)
    return int(wrong > 0)


def contents(release: Path) -> dict[str, str]:
    """SHA-256 of every hashed file, as the manifest tells them, and the manifest itself."""
    if not (release / "manifest.json").is_file():
        return {}
    text = (release / "manifest.json").read_text(encoding="utf-8")
    lying = {p.relative_to(release).as_posix() for p in release.rglob("*") if p.is_file()} - NOT_HASHED
    told = json.loads(text)["files"]
    hashes = {path: one["sha256"] for path, one in told.items()}
    return hashes | {"manifest.json": text, "lying": " ".join(sorted(lying))}


def _started(root: Path, out: Path, workers: int) -> subprocess.Popen:
    out.parent.mkdir(parents=True, exist_ok=True)
    words = [sys.executable, "-m", "addb_viewer", "dataset", "build", str(root), "--out", str(out), *TERMS]
    return subprocess.Popen([*words, "--workers", str(workers)], stdout=subprocess.DEVNULL)


def _killed(client: subprocess.Popen, victim: str, after: float) -> str:
    """What was killed; a worker that is not there yet is waited for."""
    time.sleep(after)
    with suppress(psutil.Error):
        workers = psutil.Process(client.pid).children(recursive=True)
        if victim == "client":
            client.send_signal(signal.SIGKILL)
            psutil.wait_procs(workers, timeout=30)
            return f"client and its {len(workers)} workers"
        if workers:
            os.kill(workers[0].pid, signal.SIGKILL)
            return "worker"
    return "nothing was running"


if __name__ == "__main__":
    sys.exit(main())
