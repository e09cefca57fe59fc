"""Salts and seals: a published hash of each truth binds whoever keeps it, and tells nothing before."""

import hashlib
import json
import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

SALT_BYTES = 32
SALTS = "salts.json"
LISTING = "cases.json"


class SealError(Exception):
    """A truth is not the one that was published."""


@dataclass(frozen=True)
class Salts:
    """What only the keeper of the truth knows: one salt for the draw of all cases, and one for each truth.

    The draw has its own salt because a seed of few digits could be found by making the cases for every seed.
    """

    draw: str  # hexadecimal
    cases: dict[str, str]

    def seed(self, seed: int) -> int:
        """The seed of the draw."""
        return int.from_bytes(hashlib.sha256(bytes.fromhex(self.draw) + str(seed).encode()).digest())


def kept_salts(truth: Path, names: Sequence[str]) -> Salts:
    """The salts of TRUTH/salts.json; those that are not there yet are drawn and written first."""
    path = truth / SALTS
    held = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    own = held.get("cases", {})
    salts = Salts(held.get("draw") or _drawn(), own | {n: _drawn() for n in names if n not in own})
    truth.mkdir(parents=True, exist_ok=True)
    text = json.dumps({"draw": salts.draw, "cases": salts.cases}, indent=1) + "\n"
    path.write_text(text, encoding="utf-8")
    return salts


def seal(salt: str, truth: bytes) -> str:
    """SHA-256 of the salt's bytes followed by the bytes of the truth's file."""
    return hashlib.sha256(bytes.fromhex(salt) + truth).hexdigest()


def write_listing(out: Path, truth: Path, names: Sequence[str]) -> None:
    """Write OUT/cases.json: names and seals, nothing else."""
    salts = kept_salts(truth, names)
    cases = [{"name": n, "sha256": seal(salts.cases[n], _bytes_of(truth, n))} for n in sorted(names)]
    (out / LISTING).write_text(json.dumps({"cases": cases}, indent=1) + "\n", encoding="utf-8")


def check_seals(listing: Path, truth: Path) -> int:
    """How many truths are those that were published.

    Raises:
        SealError: one is missing or another.
    """
    published = json.loads(listing.read_text(encoding="utf-8"))["cases"]
    salts = json.loads((truth / SALTS).read_text(encoding="utf-8"))["cases"]
    for case in published:
        name = case["name"]
        if name not in salts or not (truth / f"{name}.json").exists():
            raise SealError(f"{name}: {truth} holds no truth or no salt for it, but {listing} lists it.")
        if seal(salts[name], _bytes_of(truth, name)) != case["sha256"]:
            raise SealError(f"{name}: this truth is not the one whose hash {listing} holds.")
    return len(published)


def _bytes_of(truth: Path, name: str) -> bytes:
    return (truth / f"{name}.json").read_bytes()


def _drawn() -> str:
    return secrets.token_hex(SALT_BYTES)
