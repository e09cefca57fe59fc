"""The Record panel's pieces of the page."""

from addb_viewer.app.record.record_controller import written_html

SPITEFUL = "<img src=x onerror=alert(1)>.rrd"


def test_recordings_say_where_they_are_how_large_and_what_opens_them(tmp_path):
    files = [tmp_path / name for name in ("b.rrd", "a.mcap")]
    files[0].write_bytes(b"x" * 2_340_000)
    files[1].write_bytes(b"")
    page = written_html(files)
    assert str(tmp_path) in page
    assert "2.3 MB" in page
    assert "rerun &quot;b.rrd&quot;" in page
    assert page.index("b.rrd") < page.index("a.mcap")
    assert "No files yet" in written_html([])


def test_names_are_shown_as_text(tmp_path):
    file = tmp_path / SPITEFUL
    file.touch()
    assert "<img" not in written_html([file])
