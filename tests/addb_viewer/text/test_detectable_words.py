"""What "nothing wrong" is worth, in words."""

from addb_viewer.text.detectable_words import BLIND, cannot_tell, what_would_be_found
from tests.addb_viewer.told_diagnosis import told as told_of


def size(id, target, parameter, value):
    return {"id": id, "target": target, "parameter": parameter, "size": value}


def test_sizes_are_rounded_up_in_the_unit_that_people_use():
    section = what_would_be_found(told_of({"detectable": [size("clock_offset", "all", "offset_s", 0.00231)]}))
    assert section.rows == (("forces shifted in time against the markers", "2.4 ms"),)


def test_the_worst_direction_of_each_plate_counts():
    sizes = [
        size("plate_position", "plate_1", "shift_x_m", 0.008),
        size("plate_position", "plate_1", "shift_z_m", 0.012),
        size("plate_position", "plate_2", "shift_x_m", 0.047),
    ]
    ((what, told),) = what_would_be_found(told_of({"detectable": sizes})).rows
    assert what == "wrong position of a plate"
    assert told == "12 mm (plate 1), 47 mm (plate 2)"
    far = [size("plate_position", f"plate_{k}", "shift_x_m", 0.008 + 0.05 * (k - 1)) for k in (1, 2, 3, 4)]
    told = what_would_be_found(told_of({"detectable": far})).rows[0][1]
    assert told == "8.0 mm (plate 1) to 160 mm (plate 4)"
    alike = [size("plate_yaw", f"plate_{k}", "yaw_deg", 3.44) for k in (1, 2)]
    assert what_would_be_found(told_of({"detectable": alike})).rows[0][1] == "3.5°"


def test_nothing_is_told_where_something_was_found():
    assert what_would_be_found(told_of({"detectable": []})).rows == ()
    assert what_would_be_found(told_of({})).lines == ()


def test_a_size_that_makes_no_sense_is_not_told():
    """Standing still, a camera scale of 200 % would be needed; of two plates one is good enough."""
    still = {"detectable": [size("capture_scale", "all", "scale", 2.0)]}
    assert what_would_be_found(told_of(still)).rows == (("wrong scale of the camera calibration", BLIND),)
    assert cannot_tell(told_of(still)) == ["wrong scale of the camera calibration"]
    turned = {"detectable": [size("plate_yaw", f"plate_{k}", "yaw_deg", 6.0 * k) for k in (1, 4)]}
    assert cannot_tell(told_of(turned)) == []
