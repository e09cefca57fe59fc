"""From a selection to a verdict: names, rivals, gain, and what is left."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from solver.diagnosis.cause_decisions import Trail, compare_chances, is_only_tentative, is_unexplained
from solver.diagnosis.causes.effect import Estimate, in_view
from solver.diagnosis.causes.marker_effect import MarkerFinding
from solver.diagnosis.deciding.deciding_trial import trial_to_be_sure
from solver.diagnosis.diagnosis import CLEAN, EXPLAINED, UNEXPLAINED, Gain, Location, Remaining, Unlisted
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport, Rival, cause_of, finite, told_decisions
from solver.diagnosis.force_histories import force_histories
from solver.diagnosis.held_out_gain import BlockScores, block_scores, blocks, short_blocks
from solver.diagnosis.marker_causes import NOTHING_SEEN, SeenInMarkers
from solver.diagnosis.residual_description import describe_residual
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.contenders import (
    LEAST_UNKNOWN_SHARE,
    MOST_TOLD_NATS,
    RIVAL_NATS,
    RIVAL_SHARE,
    TEMPER_NATS,
    Contender,
    Found,
)
from solver.diagnosis.search.proposed_causes import Remainder
from solver.diagnosis.search.selection import CorrectedCause, Selection
from solver.diagnosis.search.terms import Solved, Term
from solver.diagnosis.unmodelled.open_world import PLATE, TIME, Held, Standing, Unknown, hold_names
from solver.diagnosis.unmodelled.remainder import UnknownForce, dependence
from solver.diagnosis.unmodelled.unexplained import Kept, keep_beside_the_unknown, position, size_N
from solver.fitting.diagnosis_settings import DiagnosisSettings

# of a name at most while something else stays unexplained, which it may stand in for: a plate in pounds
# beside a harness, in a real recording, was held for certain
SURE_BESIDE_UNEXPLAINED = 0.9
STD_INFLATION = 1.3  # by calibration on hidden effects
TOLERATED_SHARE = 0.05  # of what named causes took away; a contact is never described to the last newton
BOOTSTRAPS = 400
MARKER_TEMPER = 10.0  # [nats] of a marker's own likelihood, whose errors are far from independent
MOST_ALTERNATIVES = 2  # with the named cause, as many as anybody can look into


def conclude(balance: Balance, selection: Selection, seen: SeenInMarkers = NOTHING_SEEN) -> DiagnosisReport:
    """Verdict, causes with confidence, rivals, gain on held-out blocks, remainder.

    Args:
        balance: of all trials, markers repaired.
        selection: causes found in it.
        seen: causes that the markers showed before.
    """
    settings = balance.settings
    kept = keep_beside_the_unknown(balance, selection)
    world = hold_names(balance, kept, selection.candidates, selection.trail)
    solved, found = world.solved, world.found
    some, guards = blocks(balance), 0
    if any(_happens_once(balance, solved, k) for k in range(len(solved.terms))):
        short = short_blocks(balance)
        some, guards = (short, 1) if short else (some, 0)
    before = block_scores(balance, selection.uncorrected, solved.noise_scale, some, guards)
    after = block_scores(balance, solved.terms, solved.noise_scale, some, guards)
    left = None
    if len(found) == len(kept.found) and not _has_a_class(world.unknown):
        left = _left_to_tell(balance, kept, selection.trail)
    unexplained = is_unexplained(left, world.unknown, solved)
    most = SURE_BESIDE_UNEXPLAINED if unexplained else 1.0
    named = [_named(balance, solved, f, s) for f, s in zip(found, world.standings, strict=True)]
    named = [replace(effect, confidence=min(effect.confidence, most)) for effect in named]
    named += [_of_markers(f) for f in _together(seen.findings)]
    named += [_of_reading(balance, c) for c in selection.corrected]
    effects = tuple(sorted(named, key=lambda e: -e.confidence))
    verdict = UNEXPLAINED if unexplained else EXPLAINED if named else CLEAN
    gains = _gains(before, after) if named else {}
    decisions = selection.trail.listed({(e.id, e.target) for e in named})
    beyond = max(world.unknown_nats, -np.inf if left is None else left.gain)
    if named and np.isfinite(seen.marker_rms_before_m):
        gains["marker_rms_m"] = Gain(seen.marker_rms_before_m, seen.marker_rms_after_m)
    return DiagnosisReport(
        verdict=verdict,
        effects=effects,
        alternatives=tuple(
            a
            for f, s in zip(found, world.standings, strict=True)
            for a in _alternatives(balance, solved, f, s)
        ),
        gain=gains,
        remaining=Remaining(
            linear_residual_N=after.rms()[0],
            noise_floor_N=_noise_floor(balance, solved),
            location=_location(balance, left),
            off_the_list=_off_the_list(balance, world),
        ),
        trials=tuple(s.name for s in balance.scenes),
        residual=describe_residual(balance, solved, selection.uncorrected),
        at_fault=tuple(dict.fromkeys(effect.at_fault for effect in effects)),
        evidence_nats=finite(_evidence(selection, solved if left is None else left.solved, seen)),
        certain_nats=settings.certain_gain,
        ended_early=selection.ended_early,
        decisions=told_decisions(decisions),
        chances=None if named else compare_chances(decisions, beyond, settings),
        rates_Hz={s.name: s.rate for s in balance.scenes},
        starts_s={s.name: s.motion.start_time for s in balance.scenes},
        to_be_sure=trial_to_be_sure(balance, world),
        scale_factor=balance.scenes[0].scale_factor,
    )


def _left_to_tell(balance: Balance, kept: Kept, trail: Trail) -> Contender | None:
    """What is left, if it is more than what named causes never describe to the last newton."""
    left, tolerated = kept.left, _tolerated_N(balance, kept.solved)
    if left is None:
        return None
    size = size_N(balance, left)
    proposal = Remainder(balance, left, kept.solved, kept.found, size, tolerated)
    return left if trail.put(proposal).fell_at is None else None


def _evidence(selection: Selection, last: Solved, seen: SeenInMarkers) -> float:
    """Log evidence of the forces, and of the markers on the same scale [nats]."""
    in_forces = last.log_evidence - selection.null.log_evidence
    on_reading = sum(c.contender.gain for c in selection.corrected)
    in_markers = sum(finding.gain for finding in seen.findings)
    return float(in_forces + on_reading + in_markers * TEMPER_NATS / MARKER_TEMPER)


def _happens_once(balance: Balance, solved: Solved, k: int) -> bool:
    """Whether a cause acts for a while only: half a second of its time history tells nothing of another."""
    term = solved.terms[k]
    x, _ = solved.of(k)
    linear = x[: len(x) - len(term.tangent_mean)]
    stretches = term.candidate.frames(balance.scenes, solved.eta(k)[0], linear)
    touched = {r.trial for r in stretches}
    return sum(r.end - r.start for r in stretches) < sum(
        s.frames for s in balance.scenes if s.name in touched
    )


def _tolerated_N(balance: Balance, solved: Solved) -> float:
    """A practical minimum, and a few percent of what the named causes explain."""
    explained, first = np.zeros(len(balance.residual)), 0
    for term in solved.terms:
        width = term.columns.shape[1]
        explained += term.columns @ solved.x[first : first + width]
        if term.fixed is not None:
            explained += term.fixed
        first += width
    force = explained.reshape(-1, 6)[:, :3]
    size_N = float(np.sqrt((force**2).sum(axis=1).mean()))
    return LEAST_UNKNOWN_SHARE * balance.scenes[0].weight_N + TOLERATED_SHARE * size_N


def _has_a_class(unknown: Unknown | None) -> bool:
    """Whether it is known what the unknown touches; a force on the body is told by where it acts."""
    return unknown is not None and unknown.cause.kind in (PLATE, TIME)


def _off_the_list(balance: Balance, world: Held) -> Unlisted | None:
    if world.unknown is None:
        return None
    cause, likeliest = world.unknown.cause, world.unknown.likeliest
    k = len(likeliest.terms) - 1
    x, _ = likeliest.of(k)
    frames = in_view(cause.frames(balance.scenes, (), x), balance.scenes)
    return Unlisted(
        cause.kind,
        cause.target,
        cause.trial,
        cause.about.sentence.format(target=cause.target),
        tuple((r.trial, r.start, r.end) for r in frames),
        world.unknown.size_N(balance.scenes),
        world.unknown_nats,
    )


def _named(balance: Balance, solved: Solved, found: Found, standing: Standing) -> Cause:
    term, k = found.contender.term, position(solved, found.contender.term)
    candidate = term.candidate
    x, _ = solved.of(k)
    linear = x[: len(x) - len(term.tangent_mean)]
    eta, _ = solved.eta(k)
    wider = STD_INFLATION
    estimates = {n: Estimate(e.value, wider * e.std) for n, e in solved.estimates(k, balance.scenes).items()}
    ranges = in_view(candidate.frames(balance.scenes, eta, linear), balance.scenes)
    is_tentative = is_only_tentative(candidate, standing.in_its_class)
    return replace(
        cause_of(candidate.about, candidate.target, estimates, standing.confidence, ranges),
        id=candidate.id,
        outside_the_list=finite(standing.outside),
        in_its_class=finite(standing.in_its_class),
        told_as="tentative" if is_tentative else "name",
        time_histories=force_histories(candidate, balance.scenes, eta, linear),
    )


def _of_reading(balance: Balance, undone: CorrectedCause) -> Cause:
    contender = undone.contender
    candidate = contender.term.candidate
    return cause_of(
        candidate.about,
        undone.target,
        contender.solved.estimates(0, balance.scenes),
        _confidence(contender.gain),
        candidate.frames(balance.scenes, (), np.zeros(0)),
    )


def _together(findings: Sequence[MarkerFinding]) -> list[tuple[MarkerFinding, ...]]:
    """Soft tissue that slides in one trial slides in all; what happens once stays by itself."""
    apart: dict[tuple[object, ...], list[MarkerFinding]] = {}
    for k, finding in enumerate(findings):
        own = () if finding.of_the_body else (k,)
        apart.setdefault((finding.id, finding.target, *own), []).append(finding)
    return [tuple(sorted(same, key=lambda f: -f.gain)) for same in apart.values()]


def _of_markers(same: tuple[MarkerFinding, ...]) -> Cause:
    finding = same[0]
    confidence = _confidence(max(0.0, finding.gain), MARKER_TEMPER)
    ranges = [f.frames for f in same]
    return cause_of(finding.about, finding.target, finding.parameters, confidence, ranges)


def _confidence(gain: float, temper_nats: float = TEMPER_NATS) -> float:
    return float(1 - np.exp(-min(MOST_TOLD_NATS, gain) / temper_nats))


def _alternatives(balance: Balance, solved: Solved, one: Found, standing: Standing) -> list[Rival]:
    """Rivals that do nearly as well in its place, beside all the other causes."""
    named, listed, shares = one.contender.term, [], {id(r.contender): r.share for r in standing.rivals}
    for rival in _likeliest(one, balance.settings):
        candidate = rival.term.candidate
        listed.append(
            Rival(
                candidate.id,
                candidate.target,
                f"{named.candidate.id} {named.candidate.target}",
                f"indistinguishable here: cosine {likeness(named, rival.term, solved):.2f}, log evidence "
                f"{one.contender.gain - rival.gain:+.1f} in favour of the first",
                candidate.about.separate_by or named.candidate.about.separate_by,
                finite(shares.get(id(rival))),
            )
        )
    return listed


def _likeliest(one: Found, settings: DiagnosisSettings) -> list[Contender]:
    """The rival of best odds, and the best of another kind than both, if there is one."""
    margin = max(RIVAL_NATS, RIVAL_SHARE * one.contender.gain)
    odds = one.contender.odds_gain(settings)
    near = [r for r in one.rivals if min(one.contender.gain - r.gain, odds - r.odds_gain(settings)) <= margin]
    near.sort(key=lambda r: -r.odds_gain(settings))
    kinds = {r.term.candidate.id for r in (one.contender, *near[:1])}
    others = sorted(near[1:], key=lambda r: r.term.candidate.id in kinds)
    return [*near[:1], *others][:MOST_ALTERNATIVES]


def likeness(one: Term, other: Term, solved: Solved) -> float:
    """Cosine of the smallest principal angle between two whitened signatures, nuisances projected out."""
    bases = []
    for term in (one, other):
        fixed, columns = term.whiten(solved.noise_scale)
        parts = [columns * term.prior_std]
        if fixed is not None and not columns.shape[1]:
            parts.append(fixed[:, None])
        bases.append(np.linalg.qr(np.concatenate(parts, axis=1))[0])
    return float(np.linalg.svd(bases[0].T @ bases[1], compute_uv=False).max(initial=0.0))


def _gains(before: BlockScores, after: BlockScores) -> dict[str, Gain]:
    names = ("held_out_linear_residual_N", "held_out_angular_residual_Nm")
    rng = np.random.default_rng(0)
    sums = np.array([(e.reshape(-1, 2, 3) ** 2).sum(axis=(0, 2)) for e in after.error])
    counts = np.array([len(e) for e in after.error])
    draws = rng.integers(len(counts), size=(BOOTSTRAPS, len(counts)))
    rms = np.sqrt(sums[draws].sum(axis=1) / counts[draws].sum(axis=1)[:, None])
    low, high = np.percentile(rms, [2.5, 97.5], axis=0)
    return {
        name: Gain(before.rms()[i], after.rms()[i], (float(low[i]), float(high[i])))
        for i, name in enumerate(names)
    }


def _noise_floor(balance: Balance, solved: Solved) -> float:
    """RMS norm of what a held-out block's force may be off by [N], without any cause."""
    some = blocks(balance)
    variance: list[Float[np.ndarray, "windows 6"]] = []
    for own in some:
        Q_own = solved.noise_scale.precision_at(slice(int(own[0]), int(own[-1]) + 1))
        variance.append(np.diag(np.linalg.inv(Q_own)).reshape(-1, 6))
    return float(np.sqrt(np.concatenate(variance)[:, :3].sum(axis=1).mean()))


def _location(balance: Balance, left: Contender | None) -> Location | None:
    """None where nothing is left, or where a moment is, which has no place."""
    candidate = None if left is None else left.term.candidate
    if left is None or not isinstance(candidate, UnknownForce):
        return None
    k = len(left.solved.terms) - 1
    estimates = left.solved.estimates(k, balance.scenes)
    x, _ = left.solved.of(k)
    scene = candidate.scene(balance.scenes)
    body = candidate.nearest_body(scene)
    force = candidate.force_ground(scene, x)
    return Location(
        body=body,
        rms_force_N=estimates["rms_force_N"].value,
        mean_force_N=tuple(estimates[f"mean_force_{a}_N"].value for a in "xyz"),  # type: ignore[arg-type]
        depends_on=dependence(scene, force, scene.skeleton.body_index(body), candidate.frequency_Hz),
    )
