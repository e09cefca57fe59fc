from solver.kinematics.label_faults.fault import EXCHANGED, MASKED, LabelFault, notes_of

SWAP = LabelFault(("RTH1", "RTH2"), 100, 160, EXCHANGED, 60, 0.043, 0.002, 4)
CRASH = LabelFault(("LASI",), 20, 30, MASKED, 8, 0.081, None, 3, onto="RASI")


def test_notes_name_labels_frames_what_was_done_and_why():
    crash, swap = notes_of((SWAP, CRASH))
    assert swap == (
        "labels RTH1 and RTH2 were swapped in frames 100-159 and are swapped back: distances to 4 "
        "markers near them were 4.3 cm off, and are 0.2 cm off now"
    )
    assert crash == (
        "label LASI lay on the trajectory of RASI in frames 20-29 and is left out there (8 frames): "
        "distances to 3 markers near it were 8.1 cm off"
    )


def test_a_ghost_and_a_persons_word():
    assert "lay off its segment in frames 5-9" in LabelFault(("A",), 5, 10, MASKED, 5, 0.06).note
    accepted = LabelFault(("A", "B"), 5, 10, EXCHANGED, 5, accepted=True)
    assert accepted.note == (
        "labels A and B swapped back in frames 5-9, as found by a diagnosis and accepted"
    )
