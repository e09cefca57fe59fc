"""The tab of curves in a real browser: searched, chosen, removed, remembered; by time and by gait cycle."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.capture.formats.analog_channels import AnalogChannels
from solver.export.c3d_file import C3dRecording, write_c3d
from solver.gait.cycles import Cycle
from solver.gait.trial_gait import Gait
from tests.addb_viewer.chromium import resting_box
from tests.made_std import made_std

SOLEUS = (1e-4 * np.random.default_rng(6).normal(size=4000)).astype(np.float32)
pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def app(tmp_path_factory, make_replay, make_app):
    """Two walks, of which the first has two strides of the right foot and one of the left."""
    walk, std = make_replay(), made_std(200, 3)
    std.torque[:] *= 500  # 20 N·m
    walk = replace(walk, joints=replace(walk.joints, std=std))
    app = make_app(tmp_path_factory.mktemp("subject"), [walk, make_replay("run", 180)], login="Zoë")
    cycles = [Cycle(foot, s, s + 0.3, s + 0.5, 1.0, 0.5, 0.1) for foot, s in ((0, 2.3), (0, 2.8), (1, 2.6))]
    library = app.subjects.subject(".").fits.shown
    library.strides = {"walk": Gait(("calcn_r", "calcn_l"), (), tuple(cycles))}
    library.strides["run"] = library.strides["walk"]
    analog = AnalogChannels(("Soleus",), ("V",), SOLEUS[:, None], 1000.0)
    recorded = C3dRecording(Markers(("A",), np.ones((400, 1, 3)), 100.0), analog=analog)
    write_c3d(library.results.parent / "walk.c3d", recorded)
    library.recorded["walk"] = (library.results.parent / "walk.c3d",)
    yield app
    app.close()


@pytest.fixture(scope="module")
def page(open_page, app):
    page = open_page(app)
    yield page
    assert page.errors == []
    page.close()


def titles(page):
    return page.locator("#addb-plots figcaption > b").all_text_contents()


def test_a_curve_is_found_by_its_words_added_and_taken_away(page, until):
    usual = ["Marker error [cm]", "Vertical force [N]", "Knee flexion angle [°]", "Knee flexion torque [N·m]"]
    until(lambda: titles(page) == usual, "the usual curves")
    search = page.get_by_role("combobox", name="Add a curve")
    search.fill("knee velocity")
    options = page.locator("#addb-curve-list [role=option]")
    until(lambda: options.all_text_contents() == ["Knee flexion speed°/s"], "what is called so")
    page.keyboard.press("Enter")
    until(lambda: titles(page) == [*usual, "Knee flexion speed [°/s]"], "the new curve")
    page.keyboard.press("Escape")
    page.keyboard.press("k")  # the keys are the review's again, and nothing is typed
    until(lambda: not page.locator("#addb-curve-list").is_visible())
    assert search.input_value() == ""
    page.get_by_role("button", name="Take away Marker error").click()
    until(lambda: titles(page) == [*usual[1:], "Knee flexion speed [°/s]"], "without marker error")
    page.get_by_role("button", name="Take away Knee flexion speed").click()
    page.get_by_role("button", name="Take away Vertical force").click()
    until(lambda: titles(page) == usual[2:], "what is left")


def test_the_cursor_is_read_out_and_a_click_goes_to_its_frame(page, until):
    plots = resting_box(page.locator("#addb-plots"))
    left, width = plots["x"] + 46, plots["width"] - 46 - 10
    page.mouse.click(left + width / 2, plots["y"] + 60)
    until(lambda: abs(page.session.frame - 100) <= 1, "the frame")
    page.mouse.move(500, 300)
    angle = page.session.replay.joints.position[page.session.frame, 1] * 180 / 3.141592653589793
    chart = page.locator("#addb-plots figure", has_text="Knee flexion angle")
    value = chart.locator(".addb-plot-values span").first
    until(
        lambda: abs(float(value.text_content().replace("−", "-")) - angle) < 0.06, "the value at the cursor"
    )
    torque = page.locator("#addb-plots figure", has_text="Knee flexion torque").locator(
        ".addb-plot-values span"
    )
    used = page.session.replay.residual.used
    for frame, told in ((int(used.argmax()), ""), (int((~used).argmax()), "not measured, or not counted")):
        page.evaluate("(frame) => window.addb.send('go_to', `${frame}`)", frame)
        until(lambda told=told: torque.first.get_attribute("title") == told, "whether it counts")


def test_a_band_lies_behind_the_curve_and_is_read_out_at_the_pointer(page, until):
    plots = resting_box(page.locator("#addb-plots"))
    page.mouse.move(plots["x"] + 46 + (plots["width"] - 56) / 2, plots["y"] + 60)
    values = page.locator("#addb-plots .addb-plot-values")
    until(lambda: values.nth(0).text_content().count(" ± 1.1") == 2, "the angle's")
    until(lambda: values.nth(1).text_content().count(" ± 39") == 2, "the torque's")
    red, green, _ = page.evaluate(
        """() => {  // the right torque is 38 N·m there; its band holds 60, on an axis from −90 to 90
          const canvas = [...document.querySelectorAll("#addb-plots canvas")].at(-1);
          const x = 46 + (canvas.clientWidth - 56) * 100 / 199, y = canvas.clientHeight * (1 - 150 / 180);
          const ratio = window.devicePixelRatio;
          return [...canvas.getContext("2d").getImageData(x * ratio, y * ratio, 1, 1).data].slice(0, 3);
        }"""
    )
    assert green > red + 10
    page.mouse.move(500, 300)
    until(lambda: "±" not in values.nth(0).text_content(), "the values at the cursor")


def test_an_analog_channel_is_drawn_read_out_and_written_sample_by_sample(page, app, until):
    search = page.get_by_role("combobox", name="Add a curve")
    search.fill("emg")
    until(lambda: page.locator("#addb-curve-list [role=option]").all_text_contents() == ["SoleusV"])
    page.keyboard.press("Enter")
    page.keyboard.press("Escape")
    until(lambda: titles(page)[-1] == "Soleus [V]", "the channel")
    page.evaluate("window.addb.send('go_to', '77')")
    value = page.locator("#addb-plots figure").last.locator(".addb-plot-values")
    expected = SOLEUS[2000 + 770]  # the trial begins at 2 s
    until(lambda: abs(float(value.text_content().replace("−", "-")) - expected) < 6e-8, "the value")
    page.get_by_role("button", name="CSV").click()
    file = app.subjects.subject(".").results / "curves" / "walk_analog.csv"
    until(file.is_file, "the file")
    rows = np.loadtxt(file, delimiter=",", skiprows=1)
    assert file.read_text().startswith('"time_s","Soleus_V"\n')
    np.testing.assert_allclose(rows[:, 0], np.arange(4000) / 1000, atol=1e-12)
    np.testing.assert_array_equal(rows[:, 1].astype(np.float32), SOLEUS)
    page.get_by_role("button", name="Take away Soleus").click()
    until(lambda: len(titles(page)) == 2, "what was there")
    for written in (file, file.with_name("walk.csv")):
        written.unlink()


def test_a_recording_that_is_gone_is_named_where_its_channel_would_be(page, app, until):
    library = app.subjects.subject(".").fits.shown
    file = library.recorded["walk"][0]
    file.rename(file.with_suffix(".away"))
    page.evaluate("window.addb.send('curves', {chosen: ['knee_angle angle', 'analog Soleus'], by: 'time'})")
    until(lambda: "walk.c3d: cannot be read" in page.locator("#addb-curve-note").text_content())
    file.with_suffix(".away").rename(file)
    page.evaluate(
        "window.addb.send('curves', {chosen: ['knee_angle angle', 'knee_angle torque'], by: 'time'})"
    )
    until(lambda: page.locator("#addb-curve-note").text_content() == "", "nothing to say")


def test_strides_are_counted_read_out_overlaid_written_and_remembered(page, app, until):
    page.get_by_role("button", name="by gait cycle").click()
    keys = page.locator("#addb-plots figcaption").first
    until(lambda: "right (2)" in keys.text_content(), "the strides")
    assert "left (1)" in keys.text_content()
    plots = resting_box(page.locator("#addb-plots"))
    left, width = plots["x"] + 46, plots["width"] - 46 - 10
    page.mouse.move(left + width / 2, plots["y"] + 60)
    until(lambda: "±" in page.locator(".addb-plot-values").first.text_content(), "mean and deviation")
    page.mouse.click(left + width / 2, plots["y"] + 60)
    until(lambda: page.session.frame in (55, 105), "half of a stride of the right foot")
    page.get_by_role("button", name="per kg").click()
    until(lambda: titles(page)[1] == "Knee flexion torque [N·m/kg]", "torque for each kilogram")
    page.get_by_role("button", name="per kg").click()
    page.get_by_role("button", name="Other trials").click()
    page.get_by_role("checkbox", name="run").check()
    until(
        lambda: page.locator("#addb-curve-over").text_content().strip() == "run",
        "the legend of the other trial",
    )

    # what is shown is written as CSV
    page.get_by_role("button", name="CSV").click()
    folder = app.subjects.subject(".").results / "curves"
    written = {"walk_by_cycle.csv", "walk_by_cycle_strides.csv"}
    until(lambda: folder.is_dir() and {file.name for file in folder.iterdir()} == written, "the files")
    page.get_by_text("walk_by_cycle.csv and walk_by_cycle_strides.csv").first.wait_for()
    assert '"run","left"' in (folder / "walk_by_cycle.csv").read_text()

    # the browser remembers the choice
    page.reload()
    page.wait_for_selector("#root canvas")
    until(lambda: titles(page) == ["Knee flexion angle [°]", "Knee flexion torque [N·m]"], "what was chosen")
    assert page.get_by_role("button", name="by gait cycle").get_attribute("aria-pressed") == "true"
    assert page.locator("#addb-curve-over").text_content().strip() == "run"
