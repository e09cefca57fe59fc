"""Direct checks on recordings of exact truth: somebody bounces on two plates and shifts the load."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import Capture, ForcePlate, Markers
from solver.capture.trial import READING
from solver.common.gravity import GRAVITY
from solver.diagnosis.causes.rearranged_plate import MIRRORS, TURNS_DEG, PlateMirror, PlateTurn
from solver.diagnosis.direct_checks.lag import LAG_BIAS_S, lag_of
from solver.diagnosis.direct_checks.measured import measure_trials
from solver.diagnosis.direct_checks.pressure_path import turns_by_path
from solver.diagnosis.direct_checks.run_checks import run_checks
from solver.diagnosis.direct_checks.statement import REFUTING_NATS, STATED_NATS, About, nats_of
from solver.diagnosis.direct_checks.weight import carried_kg, carried_mass, weighings

MASS_KG = 70.0
FEET = {  # x and z of heel and toe markers; their middle is where the foot presses
    "heel_r": (0.1, -0.05),
    "toe_r": (0.1, 0.15),
    "heel_l": (0.5, -0.05),
    "toe_l": (0.5, 0.15),
}
PLACES = ((0.1, 0.05), (0.5, 0.05))
TRUNK = 8  # markers
RATE, FORCE_RATE, SECONDS = 100.0, 1000.0, 4.0


def bounce(times, amplitude_m=0.02, frequency_Hz=1.5):
    """Height and acceleration."""
    w = 2 * np.pi * frequency_Hz
    return amplitude_m * np.sin(w * times), -amplitude_m * w**2 * np.sin(w * times)


def standing_person(late_s=0.0, name="made up", mass_kg=MASS_KG):
    """Everything but the feet bounces alike; the load goes to and fro between the plates."""
    times = np.arange(round(SECONDS * RATE)) / RATE
    names = [*FEET, *(f"trunk{k}" for k in range(TRUNK))]
    positions = np.zeros((len(times), len(names), 3))
    for k, (x, z) in enumerate(FEET.values()):
        positions[:, k] = (x, 0.03, z)
    # Shanks and thighs have no markers, so that they go with the trunk; the feet's share stays down.
    moving = 0.97
    for k in range(TRUNK):
        positions[:, 4 + k] = (0.3 + 0.12 * (k % 2), 1.0 + 0.06 * k, 0.05 + 0.1 * (k // 2 % 2))
        positions[:, 4 + k, 1] += bounce(times)[0]
    force_times = np.arange(round(SECONDS * FORCE_RATE)) / FORCE_RATE
    total = mass_kg * (GRAVITY + moving * bounce(force_times - late_s)[1])
    share = 0.5 + 0.1 * np.sin(2 * np.pi * 0.7 * (force_times - late_s))
    plates = tuple(
        plate(f"plate {k + 1}", part * total, place)
        for k, (part, place) in enumerate(zip((share, 1 - share), PLACES, strict=True))
    )
    return Capture(name, Markers(tuple(names), positions, RATE), plates)


def plate(name, vertical, place):
    force = np.stack([0 * vertical, vertical, 0 * vertical], axis=1)
    centre = np.broadcast_to([place[0], 0.0, place[1]], force.shape)
    return ForcePlate(name, force, np.cross(centre, force), centre.copy(), FORCE_RATE)


def changed(capture, k, **values):
    plates = list(capture.plates)
    plates[k] = replace(plates[k], **values)
    return replace(capture, plates=tuple(plates))


def with_evidence(*captures, entered_kg=MASS_KG):
    return run_checks(measure_trials(captures, READING), entered_kg)


def spoken(said):
    return {about for one in said for about in one.spoken_for(STATED_NATS)}


def test_a_sound_recording_leaves_all_direct_checks_quiet():
    said = with_evidence(standing_person())
    assert {"weight", "lag", "exchange between plates", "point of the changes", "path of the pressure"} <= {
        one.direct_check for one in said
    }
    assert spoken(said) == set()


@pytest.mark.parametrize("true_kg", [55.0, 70.0, 91.0])
def test_the_mass_that_is_carried_is_the_persons(true_kg):
    found = carried_mass(measure_trials([standing_person(mass_kg=true_kg)], READING)[0])
    assert found.mass_kg == pytest.approx(true_kg, rel=0.005)
    assert (About.ENTERED_MASS in spoken(with_evidence(standing_person(mass_kg=true_kg)))) == (
        true_kg != MASS_KG
    )


@pytest.mark.parametrize("late_s", [-0.06, 0.0, 0.025, 0.12])
def test_the_lag_is_the_one_put_in(late_s):
    """To a millisecond, but for what is taken off as the method's own on people."""
    found = lag_of(measure_trials([standing_person(late_s)], READING)[0])
    assert found.lag_s + LAG_BIAS_S == pytest.approx(late_s, abs=0.001)


def test_two_trials_with_clocks_of_their_own_are_heard():
    said = with_evidence(standing_person(0.01, "a"), standing_person(0.035, "b"))
    between = [one for one in said if "lag_beyond_others_s" in one.figures]
    assert abs(between[0].figures["lag_beyond_others_s"]) == pytest.approx(0.025, abs=0.001)
    assert About.CLOCK in spoken(between)


@pytest.mark.parametrize("gain", [0.5, 2.0])
def test_an_exchange_tells_a_plates_gain(gain):
    whole = standing_person()
    one = whole.plates[1]
    capture = changed(whole, 1, force_ground=gain * one.force_ground, moment_ground=gain * one.moment_ground)
    said = [s for s in with_evidence(capture) if s.direct_check == "exchange between plates"]
    assert said[0].figures["share"] == pytest.approx(gain, rel=0.02)
    assert About.PLATE_SCALE in spoken(said)


def test_an_exchange_tells_a_plates_sign_and_never_its_zero():
    whole = standing_person()
    one = whole.plates[1]
    turned = changed(whole, 1, force_ground=-one.force_ground, moment_ground=-one.moment_ground)
    said = [s for s in with_evidence(turned) if s.direct_check == "exchange between plates"]
    assert said[0].figures["share"] == pytest.approx(-1.0, rel=0.05)
    assert spoken(said) == {About.PLATE_SIGN}
    tared = changed(whole, 1, force_ground=one.force_ground - [0.0, 150.0, 0.0])
    said = [s for s in with_evidence(tared) if s.direct_check == "exchange between plates"]
    assert said[0].figures["share"] == pytest.approx(1.0, rel=0.02)
    assert spoken(said) == set()


def test_the_point_of_the_changes_is_free_of_a_constant_and_tells_it():
    """A level of 150 N half a metre beside the foot moves the mean pressure, not the point of the changes."""
    whole = standing_person()
    one, level = whole.plates[0], np.array([0.0, -150.0, 0.0])
    capture = changed(
        whole,
        0,
        force_ground=one.force_ground + level,
        moment_ground=one.moment_ground + np.cross([0.6, 0.0, 0.05], level),
    )
    said = [
        s
        for s in with_evidence(capture)
        if s.direct_check == "point of the changes" and s.target == "plate_1"
    ]
    assert said[0].figures["off_m"] < 0.01
    load = one.force_ground[:, 1].mean()
    assert said[0].figures["constant_off_m"] == pytest.approx(0.5 * 150.0 / (load - 150.0), rel=0.05)
    assert spoken(said) == {About.PLATE_ZERO}


def test_of_a_plate_under_a_foot_that_moves_no_point_is_told():
    """The other foot stands still, 40 cm away, and bears another plate."""
    whole = standing_person()
    positions = whole.markers.positions_ground.copy()
    slid = ["_l" in name for name in whole.markers.names]
    positions[:, slid, 0] += 0.03 * np.linspace(0.0, 1.0, len(positions))[:, None]
    capture = replace(whole, markers=replace(whole.markers, positions_ground=positions))
    points = [one for one in with_evidence(capture) if one.direct_check == "point of the changes"]
    assert [one.target for one in points] == ["plate_1"]


def test_an_empty_plate_tells_its_zero():
    whole = standing_person()
    empty = np.random.default_rng(0).normal([3.0, 25.0, -4.0], 1, (round(SECONDS * FORCE_RATE), 3))
    third = ForcePlate("plate 3", empty, 0 * empty, np.full_like(empty, np.nan), FORCE_RATE)
    said = [
        s
        for s in with_evidence(replace(whole, plates=(*whole.plates, third)))
        if s.direct_check == "empty plate"
    ]
    assert said[0].figures["y_N"] == pytest.approx(25.0, abs=0.3)
    assert About.PLATE_ZERO in spoken(said)


def test_samples_that_a_plate_lost_here_and_there_change_no_statement():
    whole = standing_person()
    empty = np.random.default_rng(0).normal([3.0, 25.0, -4.0], 1, (round(SECONDS * FORCE_RATE), 3))
    third = ForcePlate("plate 3", empty, 0 * empty, np.full_like(empty, np.nan), FORCE_RATE)
    whole = replace(whole, plates=(*whole.plates, third))
    lost = []
    for plate in whole.plates:
        force = plate.force_ground.copy()
        force[200::150, 1] = np.nan
        lost.append(replace(plate, force_ground=force))
    before, after = with_evidence(whole), with_evidence(replace(whole, plates=tuple(lost)))
    assert [(s.direct_check, s.target) for s in after] == [(s.direct_check, s.target) for s in before]
    assert spoken(after) == spoken(before)
    assert all(np.isfinite([*s.nats.values(), *s.figures.values()]).all() for s in after)


def test_a_marker_that_slips_is_told_from_markers_that_move_together():
    whole = standing_person()
    places = whole.markers.positions_ground.copy()
    places[200:, 6] += [0.04, 0.0, 0.03]
    slipped = replace(whole, markers=replace(whole.markers, positions_ground=places))
    said = [s for s in with_evidence(slipped) if s.direct_check == "rigid distances"]
    assert [(s.target, s.figures["time_s"]) for s in said] == [("trunk2", pytest.approx(2.0, abs=0.011))]
    assert spoken(said) == {About.SLIP}
    places[200:, 7] += [0.04, 0.0, 0.03]
    both = replace(whole, markers=replace(whole.markers, positions_ground=places))
    said = [s for s in with_evidence(both) if s.direct_check == "rigid distances"]
    assert [s.target for s in said] == ["trunk2+trunk3"]
    assert spoken(said) == {About.SEGMENT}


def weighed(capture, entered_kg=MASS_KG):
    return weighings(measure_trials([capture], READING), entered_kg)


@pytest.mark.parametrize("entered_kg", [MASS_KG, None])
@pytest.mark.parametrize("factor", [0.25, 0.5, 2.0, 4.448222])
def test_a_plate_in_other_units_is_told_by_what_the_person_weighs_elsewhere(factor, entered_kg):
    whole = standing_person()
    one = whole.plates[0]
    scaled = changed(
        whole, 0, force_ground=factor * one.force_ground, moment_ground=factor * one.moment_ground
    )
    least = REFUTING_NATS
    right = weighed(scaled, entered_kg).for_factors({"plate_1": factor}, {})
    assert right > least
    assert weighed(scaled, entered_kg).for_factors({"plate_2": factor}, {}) < right - least
    assert weighed(scaled, entered_kg).of_another_plate({"plate_2": factor}, {}) == pytest.approx(
        right, abs=1
    )
    assert weighed(scaled, entered_kg).of_another_plate({"plate_1": factor}, {}) < right
    assert weighed(whole, entered_kg).for_factors({"plate_1": factor}, {}) < -least


@pytest.mark.parametrize("lifted_N", [150.0, 300.0])
def test_a_harness_takes_its_force_off_every_weighing(lifted_N):
    """Of 70 kg the plates carry what is left, whatever is entered."""
    rest = standing_person(mass_kg=MASS_KG - lifted_N / GRAVITY)
    none, lift = {"made up": 0.0}, {"made up": lifted_N}
    least = REFUTING_NATS
    assert weighed(rest, None).for_lifts(lift, none, MASS_KG) > 0.4 * least
    assert weighed(standing_person(), None).for_lifts({"made up": 300.0}, none, MASS_KG) < -least
    assert weighed(standing_person()).for_lifts({"another": 300.0}, none, MASS_KG) == 0.0


def test_where_nobody_entered_a_mass_units_of_all_plates_are_not_told_from_it():
    both = {"plate_1": 2.0, "plate_2": 2.0}
    assert not weighed(standing_person(), None).tell(both, {})
    assert weighed(standing_person(), None).tell({"plate_1": 2.0}, {})
    assert weighed(standing_person()).tell(both, {})
    assert weighed(standing_person()).for_factors(both, {}) < -REFUTING_NATS


def test_a_weighing_is_the_mean_force_over_that_of_gravity_and_acceleration():
    found = weighed(standing_person()).weighings
    assert [set(w.vertical_N) for w in found] == [{"plate_1", "plate_2"}]
    assert found[0].mass_kg({}) == pytest.approx(MASS_KG, rel=0.01)
    assert found[0].mass_kg({"plate_1": 0.5, "plate_2": 0.5}) == pytest.approx(2 * MASS_KG, rel=0.01)


def hopping_person(*late_s):
    """From one plate to the other, in flight for more than half of the time; each plate so late."""
    whole, (amplitude_m, hops_Hz) = standing_person(), (0.12, 2.0)
    markers = whole.markers.positions_ground.copy()
    jump = bounce(whole.markers.times, amplitude_m, hops_Hz)[0] - bounce(whole.markers.times)[0]
    markers[:, len(FEET) :, 1] += jump[:, None]

    def read(k):
        times = np.arange(round(SECONDS * FORCE_RATE)) / FORCE_RATE - late_s[k]
        total = MASS_KG * np.maximum(GRAVITY + bounce(times, amplitude_m, hops_Hz)[1], 0.0)
        return plate(f"plate {k + 1}", total * (np.floor(hops_Hz * times) % 2 == k), PLACES[k])

    markers = replace(whole.markers, positions_ground=markers)
    return replace(whole, markers=markers, plates=(read(0), read(1)))


@pytest.mark.parametrize("late_s", [(0.25, 0.25), (0.0, 0.25), (0.25, 0.0)])
def test_forces_that_bear_while_the_motion_falls_are_no_weighing(late_s):
    said = with_evidence(hopping_person(*late_s))
    assert said
    assert np.isfinite([n for one in said for n in one.nats.values()]).all()
    assert np.isfinite([f for one in said for f in one.figures.values()]).all()


@pytest.mark.parametrize(("force_N", "asked_m_per_s2"), [(700.0, -2.0), (700.0, 0.0), (-700.0, GRAVITY)])
def test_no_mass_is_carried_by_a_fall_or_a_pull(force_N, asked_m_per_s2):
    assert carried_kg(np.full(9, force_N), np.full(9, asked_m_per_s2)) is None


def test_nothing_is_asked_of_a_recording_without_plates():
    whole = standing_person()
    assert with_evidence(replace(whole, plates=())) == ()


def test_evidence_grows_with_the_figure_and_falls_with_its_doubt():
    sizes = [nats_of(x, 0.0, 1.0, 10.0) for x in (0.0, 2.0, 5.0, 20.0)]
    assert sizes == sorted(sizes)
    assert sizes[0] < 0 < sizes[-1]
    assert nats_of(5.0, 3.0, 1.0, 10.0) < nats_of(5.0, 0.0, 1.0, 10.0)
    assert nats_of(-5.0, 0.5, 1.0, 10.0) == nats_of(5.0, 0.5, 1.0, 10.0)


def gliding_person(recorded=lambda x, z: (x, z)):
    """The right foot glides over its plate while it bears; its pressures are filed as `recorded` says."""
    whole = standing_person()
    times = np.arange(whole.plates[0].samples) / FORCE_RATE
    x, z = 0.05 * np.sin(1.1 * times), 0.08 * times - 0.16
    positions = whole.markers.positions_ground.copy()
    every = round(FORCE_RATE / RATE)
    for foot in range(2):  # its heel and toe
        positions[:, foot, 0] += x[::every]
        positions[:, foot, 2] += z[::every]
    one = whole.plates[0]
    filed_x, filed_z = recorded(x, z)
    centre = one.cop_ground + np.stack([filed_x, 0 * x, filed_z], axis=1)
    moved = changed(whole, 0, cop_ground=centre, moment_ground=np.cross(centre, one.force_ground))
    return replace(moved, markers=Markers(whole.markers.names, positions, RATE))


def path_says(causes, recorded):
    told = turns_by_path(measure_trials([gliding_person(recorded)], READING))
    return [cause.with_evidence(told).seen_elsewhere for cause in causes]


REARRANGED = [*(PlateTurn("plate_1", d) for d in TURNS_DEG), *(PlateMirror("plate_1", a) for a in MIRRORS)]


@pytest.mark.parametrize("turn_deg", TURNS_DEG)
def test_the_path_tells_which_turn_is_right(turn_deg):
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))  # about y, which points up
    nats = path_says(REARRANGED, lambda x, z: (c * x + s * z, c * z - s * x))
    right = nats.pop(TURNS_DEG.index(turn_deg))
    assert right == pytest.approx(REFUTING_NATS)
    assert max(nats) < right - 5


def test_a_path_that_goes_with_the_foot_speaks_against_every_turn():
    assert max(path_says(REARRANGED, lambda x, z: (x, z))) < 0
    assert path_says(
        [PlateTurn("plate_2", 90), PlateTurn("plate_9", 90)], lambda x, z: (x, z)
    ) == pytest.approx([0, 0])
