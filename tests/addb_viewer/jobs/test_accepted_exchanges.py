from dataclasses import replace

from addb_viewer.jobs.accepting import exchange_in_words, exchanges_of
from solver.diagnosis.causes.catalogue import cannot_be_accepted
from solver.kinematics.label_faults.fault import EXCHANGED, Exchange, LabelFault
from tests.addb_viewer.told_diagnosis import told

SWAP = {"id": "marker_swap", "target": "A+B", "parameters": {}}


def test_one_exchange_for_each_stretch_in_its_trial():
    several = {
        "trials": ["walk", "run"],
        "effects": [{**SWAP, "frames": [["run", 5, 9], ["walk", 20, 30]]}, {"id": "drag", "target": "torso"}],
    }
    assert exchanges_of(told(several)) == (
        Exchange("run", ("A", "B"), 5, 9),
        Exchange("walk", ("A", "B"), 20, 30),
    )
    alone = {"trials": ["walk"], "effects": [{**SWAP, "frames": [[5, 9]]}]}
    assert exchanges_of(told(alone)) == (Exchange("walk", ("A", "B"), 5, 9),)
    assert exchanges_of(told({})) == ()


def test_what_cannot_be_accepted():
    assert [i for i in ("marker_slip", "marker_swap", "soft_tissue", "drag") if cannot_be_accepted(i)] == [
        "marker_slip",
        "soft_tissue",
    ]


def test_whether_the_last_fit_did_that_by_itself(small_fit):
    exchange = Exchange("walk", ("A", "B"), 5, 9)
    every = "labels A and B are swapped back in frames 5-8 of walk, in every fit"
    assert exchange_in_words(exchange, None) == exchange_in_words(exchange, small_fit) == every
    found = LabelFault(("B", "A"), 6, 9, EXCHANGED, 3, 0.05, 0.002, 4)

    def fit_with(fault):
        return replace(small_fit, trials=(replace(small_fit.trials[0], label_faults=(fault,)),))

    name = small_fit.trials[0].capture.name
    there = replace(exchange, trial=name)
    assert exchange_in_words(there, fit_with(found)).endswith("; the last fit did that by itself")
    for other in (replace(found, accepted=True), replace(found, start=20, end=30)):
        assert exchange_in_words(there, fit_with(other)).endswith("in every fit")
