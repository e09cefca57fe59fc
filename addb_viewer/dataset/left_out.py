"""What is not in a release, and why: every reason there is, and the rows that say so."""

from dataclasses import asdict, dataclass

REASONS = {
    "subject": {
        "withdrawn": "the person was left out by --without, now or in an earlier build; nothing else is told",
        "no_licence": "no licence, neither in subject.toml nor by --licence; or no SPDX identifier",
        "no_consent": "consent is not public",
        "unreadable": "the folder or file cannot be read",
        "not_two_contact_bodies": "forces act on other than two feet, or no name tells the right one",
        "duplicate_subject": "the same recordings as another subject's",
        "no_trials": "none of its trials is kept",
        "fit_failed": "the fit ended in an error",
        "worker_died": "the process that fitted it died three times",
        "timed_out": "its fit took longer than --time-out; the next build tries again",
    },
    "trial": {
        "static": "it scales the body and is no trial",
        "not_listed": "its markers belong to no trial of the subject: subject.toml does not name them",
        "unreadable": "its files cannot be read",
        "no_forces": "no force plate was recorded",
        "too_short": "fewer than 12 frames",
        "not_reviewed": "nobody has finished its review, and --unreviewed was not given",
        "duplicate_trial": "the same recording as another trial",
        "no_dynamics": "too few frames count for a fit to the forces",
        "no_counting_frames": "no frame counts",
        "non_finite": "the fit has values that are no numbers",
    },
    "range": {
        "no_pose": "too few markers are seen to know where the body is",
        "erroneous": "a person said that the frames must not be used",
    },
    "segment": {"too_short": "fewer than 12 frames"},
}
"""By level, in the order in which they are asked; the first that holds is told."""


@dataclass(frozen=True)
class LeftOut:
    """Something that is not in the release."""

    level: str
    id: str
    reason: str
    detail: str = ""
    start_frame: int | None = None
    end_frame: int | None = None
    frames: int = 0
    hours: float = 0.0

    def __post_init__(self) -> None:
        """Only reasons that the table above has."""
        if self.reason not in REASONS[self.level]:
            raise ValueError(f"no reason '{self.reason}' for a {self.level}")

    def row(self) -> dict[str, object]:
        """Of the table `left_out`."""
        return asdict(self)


def hours_of(frames: int, rate_hz: float) -> float:
    """How long so many frames last [h]."""
    return frames / rate_hz / 3600
