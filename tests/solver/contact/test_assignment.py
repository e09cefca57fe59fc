"""Feet walk over plates that were laid out, and loads go where the scene put them."""

from dataclasses import replace

import numpy as np

from solver.common.notes import Kind, noted
from solver.contact.mask import NOT_RECORDED, TWO_FEET_ON_ONE_PLATE, UNDER_NO_FOOT, frame_mask
from solver.contact.wrenches import NO_FOOT, TWO_FEET

RIGHT, LEFT = 0, 1


def steps_of(walk, side):
    """Loads of the first and the second measured stance of one foot."""
    load = walk.loads[:, side]
    middle = 95 if side == RIGHT else 140
    early = np.arange(len(load)) < middle
    return np.where(early, load, 0.0), np.where(early, 0.0, load)


def test_a_plate_for_each_foot(standing):
    load = np.full(100, 350.0)
    right, left = standing.ankles[:, RIGHT] * [1, 0, 1], standing.ankles[:, LEFT] * [1, 0, 1]
    found = standing.assigned(standing.plate("1", [(load, right)]), standing.plate("2", [(load, left)]))
    assert (found.plate == [RIGHT, LEFT]).all()
    assert found.in_contact.all()
    np.testing.assert_allclose(found.wrench_ground[:, :, 1], 350.0)
    np.testing.assert_allclose(found.cop_ground[:, RIGHT], right)
    assert found.notes == ()


def test_swapped_plates_are_no_matter(standing):
    load = np.full(100, 350.0)
    right, left = standing.ankles[:, RIGHT] * [1, 0, 1], standing.ankles[:, LEFT] * [1, 0, 1]
    found = standing.assigned(
        standing.plate("right", [(load, left)]), standing.plate("left", [(load, right)])
    )
    assert (found.plate == [LEFT, RIGHT]).all()


def test_walking_over_plates_that_do_not_belong_to_a_foot(walk):
    """One plate takes the first right and the second left step, another one the steps between."""
    first_right, second_right = steps_of(walk, RIGHT)
    first_left, second_left = steps_of(walk, LEFT)
    found = walk.assigned(
        walk.plate("a", [(first_right, walk.under[:, RIGHT])]),
        walk.plate("b", [(first_left, walk.under[:, LEFT]), (second_left, walk.under[:, LEFT])]),
        walk.plate("c", [(second_right, walk.under[:, RIGHT])]),
    )
    np.testing.assert_allclose(found.wrench_ground[..., 1], walk.loads)
    np.testing.assert_array_equal(found.in_contact, walk.loads > 20)
    np.testing.assert_allclose(found.cop_ground[found.in_contact], walk.under[found.in_contact], atol=1e-9)


def test_one_plate_under_different_feet_at_different_times(walk):
    first_right, _ = steps_of(walk, RIGHT)
    _, second_left = steps_of(walk, LEFT)
    found = walk.assigned(
        walk.plate("a", [(first_right, walk.under[:, RIGHT]), (second_left, walk.under[:, LEFT])])
    )
    assert set(found.plate[first_right > 20, 0]) == {RIGHT}
    assert set(found.plate[second_left > 20, 0]) == {LEFT}


def test_treadmill_belts(treadmill_walk):
    walk = treadmill_walk
    found = walk.assigned(
        *[walk.plate(s, [(walk.loads[:, i], walk.under[:, i])]) for i, s in enumerate("rl")]
    )
    np.testing.assert_allclose(found.wrench_ground[..., 1], walk.loads)


def test_a_belt_that_takes_frames_of_the_other_foot(treadmill_walk):
    """After the right foot has left its belt, the left one steps over the gap between them for 120 ms."""
    walk = treadmill_walk
    right_belt = walk.loads[:, RIGHT].copy()
    left_belt = walk.loads[:, LEFT].copy()
    alone = np.arange(70, 82)  # left stance lasts from 50 to 110, right from 5 to 65 and from 95
    crossing = np.zeros(260)
    crossing[alone] = 0.4 * left_belt[alone]
    left_belt[alone] -= crossing[alone]
    inner = walk.under[:, LEFT] + [0.0, 0.0, 0.03]
    found = walk.assigned(
        walk.plate("r", [(right_belt, walk.under[:, RIGHT]), (crossing, inner)]),
        walk.plate("l", [(left_belt, walk.under[:, LEFT])]),
    )
    assert set(found.plate[alone, 0]) == {LEFT}
    np.testing.assert_allclose(found.wrench_ground[..., 1], walk.loads)
    point = 0.4 * inner[alone] + 0.6 * walk.under[alone, LEFT]
    np.testing.assert_allclose(found.cop_ground[alone, LEFT], point, atol=1e-9)


def test_a_foot_that_follows_the_other_onto_a_plate_without_a_pause(walk):
    """A long plate carries both feet in turn; while both stand on it, its force belongs to neither."""
    first_right, _ = steps_of(walk, RIGHT)
    first_left, _ = steps_of(walk, LEFT)
    plate = walk.plate("long", [(first_right, walk.under[:, RIGHT]), (first_left, walk.under[:, LEFT])])
    found = walk.assigned(plate)
    owner = found.plate[:, 0]
    assert set(owner[10:44]) == {RIGHT}
    assert set(owner[71:108]) == {LEFT}
    shared = np.flatnonzero(owner == TWO_FEET)
    assert shared.min() <= 50  # both feet are down from 50 to 65
    assert shared.max() >= 65
    np.testing.assert_array_equal(np.diff(shared), 1)
    np.testing.assert_array_equal(found.wrench_ground[shared], 0.0)
    assert any("two feet" in note and "plate long" in note for note in found.notes)


def test_two_feet_standing_on_one_plate(standing):
    sway = 0.02 * np.sin(np.arange(100) / 8)
    loads = [
        (350.0 * (1 + sway), standing.ankles[:, RIGHT] * [1, 0, 1]),
        (350.0 * (1 - sway), standing.ankles[:, LEFT] * [1, 0, 1]),
    ]
    found = standing.assigned(standing.plate("only", loads))
    assert (found.plate == TWO_FEET).all()
    assert not found.in_contact.any()
    np.testing.assert_array_equal(found.wrench_ground, 0.0)
    mask = frame_mask(found, np.ones(found.frames, dtype=bool))
    assert not mask.counts.any()
    assert mask.reasons == ((0, 100, None, TWO_FEET_ON_ONE_PLATE),)


def test_a_misplaced_plate_is_not_mistaken_for_two_feet(standing):
    """A centre of pressure 5 cm outside the foot on its outer side is one foot's."""
    outside = standing.ankles[:, RIGHT] * [1, 0, 1] + [0.0, 0.0, 0.09]
    found = standing.assigned(standing.plate("1", [(np.full(100, 700.0), outside)]))
    assert (found.plate == RIGHT).all()


def test_a_swinging_foot_is_not_one_of_two(walk):
    """In mid-stance the other foot passes by; a centre of pressure 5 cm off towards it changes nothing."""
    first_right, _ = steps_of(walk, RIGHT)
    inner = walk.under[:, RIGHT] + [0.0, 0.0, -0.09]
    found = walk.assigned(walk.plate("a", [(first_right, inner)]))
    middle = np.arange(25, 45)  # the left foot is down until frame 20 and from 50
    assert set(found.plate[middle, 0]) == {RIGHT}


def test_a_stray_centre_of_pressure_does_not_change_the_foot(standing):
    load = np.full(100, 350.0)
    right, left = standing.ankles[:, RIGHT] * [1, 0, 1], standing.ankles[:, LEFT] * [1, 0, 1]
    point = right.copy()
    point[50:52] = left[50:52]
    found = standing.assigned(standing.plate("1", [(load, point)]))
    assert (found.plate == RIGHT).all()


def test_a_wild_centre_of_pressure_at_the_edges_of_a_contact_does_not_count(walk):
    """At 25 N of 700 the centre of pressure wanders by half a metre."""
    first_right, _ = steps_of(walk, RIGHT)
    load = np.where((first_right > 0) & (first_right < 250), 25.0, first_right)
    load[[5, 65]] = 25.0
    point = walk.under[:, RIGHT].copy()
    point[load == 25.0] += [0.5, 0.0, 0.3]
    found = walk.assigned(walk.plate("a", [(load, point)]))
    assert set(found.plate[load > 20, 0]) == {RIGHT}


def test_a_plate_far_from_both_feet_goes_to_neither(standing):
    chair = np.tile([-0.6, 0.4, 0.0], (100, 1))
    found = standing.assigned(standing.plate("chair", [(np.full(100, 300.0), chair)]))
    assert (found.plate == NO_FOOT).all()
    np.testing.assert_array_equal(found.wrench_ground, 0.0)
    assert any("plate chair" in note and "no foot" in note for note in found.notes)


def test_frames_whose_load_goes_to_no_foot_do_not_count(standing):
    chair, load = np.tile([-0.6, 0.4, 0.0], (100, 1)), np.zeros(100)
    load[30:60] = 300.0
    found = standing.assigned(standing.plate("chair", [(load, chair)]))
    mask = frame_mask(found, np.ones(found.frames, dtype=bool))
    np.testing.assert_array_equal(mask.all_feet, load == 0)
    assert mask.reasons == ((30, 60, None, UNDER_NO_FOOT),)


def test_what_lies_on_a_plate_all_along_is_nobodys_force(standing):
    box = standing.plate("box", [(np.full(100, 60.0), np.tile([-0.6, 0.0, 0.0], (100, 1)))])
    found = standing.assigned(box)
    assert frame_mask(found, np.ones(found.frames, dtype=bool)).counts.all()
    assert any("plate box" in note and "no foot" in note for note in found.notes)


def test_an_unloaded_plate_says_nothing(standing):
    """Its noise goes nowhere, and no foot is in contact."""
    plate = standing.plate("idle", [], noise=5.0)
    found = standing.assigned(plate)
    assert not found.in_contact.any()
    assert (found.plate == NO_FOOT).all()
    np.testing.assert_array_equal(found.wrench_raw_ground, 0.0)
    assert np.isnan(found.cop_ground).all()
    assert found.notes == ()


def test_what_conditioning_noted_is_passed_on(standing):
    plate = replace(standing.plate("1", []), notes=noted(Kind.PLATES, "1: zero level of 3 N taken off"))
    assert standing.assigned(plate).notes == ("1: zero level of 3 N taken off",)


def test_the_filters_tails_go_with_their_contact(walk):
    first_right, second_right = steps_of(walk, RIGHT)
    plate = walk.plate("a", [(first_right, walk.under[:, RIGHT]), (second_right, walk.under[:, RIGHT])])
    tail = plate.force_ground.copy()
    tail[66:70, 1] = [12.0, 6.0, 2.0, 0.5]
    found = walk.assigned(replace(plate, force_ground=tail))
    np.testing.assert_allclose(found.wrench_ground[:, RIGHT, 1], tail[:, 1])
    assert not found.in_contact[66:70].any()


def test_raw_forces_follow_the_same_feet(walk):
    plates = [walk.plate(s, [(walk.loads[:, i], walk.under[:, i])], noise=3.0) for i, s in enumerate("rl")]
    found = walk.assigned(*plates)
    for side, plate in enumerate(plates):
        np.testing.assert_allclose(found.wrench_raw_ground[:, side, :3], plate.force_raw_ground)


def test_frames_without_recording_have_no_force_and_do_not_count(walk):
    plate = walk.plate("a", [(walk.loads[:, RIGHT], walk.under[:, RIGHT])])
    missing = slice(30, 40)
    arrays = ("force_ground", "moment_ground", "cop_ground", "force_raw_ground", "moment_raw_ground")
    gapped = {name: getattr(plate, name).copy() for name in arrays}
    for array in gapped.values():
        array[missing] = np.nan
    loaded, observed = plate.loaded.copy(), plate.observed.copy()
    loaded[missing] = observed[missing] = False
    found = walk.assigned(replace(plate, loaded=loaded, observed=observed, **gapped))
    np.testing.assert_array_equal(found.wrench_ground[missing], 0.0)
    assert np.isfinite(found.wrench_ground).all()
    mask = frame_mask(found, np.ones(found.frames, dtype=bool))
    np.testing.assert_array_equal(np.flatnonzero(~mask.all_feet), np.arange(30, 40))
    assert mask.reasons == ((30, 40, None, NOT_RECORDED),)


def test_a_foot_on_two_plates_gets_the_sum(standing):
    right = standing.ankles[:, RIGHT] * [1, 0, 1]
    heel, ball = right - [0.04, 0.0, 0.0], right + np.array([0.10, 0.0, 0.0])
    found = standing.assigned(
        standing.plate("rear", [(np.full(100, 200.0), heel)]),
        standing.plate("front", [(np.full(100, 500.0), ball)]),
    )
    assert (found.plate == RIGHT).all()
    np.testing.assert_allclose(found.wrench_ground[:, RIGHT, 1], 700.0)
    np.testing.assert_allclose(found.cop_ground[:, RIGHT], (200 * heel + 500 * ball) / 700, atol=1e-9)


def test_toes_named_as_a_foot_are_noted(standing):
    from solver.contact.assignment import assign
    from solver.contact.settings import ContactSettings

    found = assign(
        [standing.plate("1", [(np.full(100, 700.0), standing.ankles[:, LEFT] * [1, 0, 1])])],
        *standing.poses(),
        skeleton=standing.skeleton,
        foot_bodies=("calcn_r", "calcn_l", "toes_l"),
        times=standing.times,
        settings=ContactSettings(),
    )
    assert found.foot_bodies == ("calcn_r", "calcn_l")
    assert (found.plate == LEFT).all()
    assert any("toes_l" in note for note in found.notes)
