"""What it takes to make the fit again."""

import tomllib
from dataclasses import replace
from html import unescape

from addb_viewer.report.made_from import differing, repeat_part
from solver.fitting.settings import Settings, as_dict


def test_versions_files_and_all_settings(recording):
    provenance = {"addb-viewer": "0.1.0", "height_m": "None", "sha256 <walk>.trc": "f" * 64}
    page = repeat_part(replace(recording, fit=replace(recording.fit, provenance=provenance)))
    assert "All settings have the defaults of addb-viewer 0.1.0." in page
    assert "not given" in page
    assert f"&lt;walk&gt;.trc</th><td><code>{'f' * 64}</code>" in page
    toml = page[page.rindex("<pre>") + 5 : page.rindex("</pre>")]
    assert set(tomllib.loads(unescape(toml))) == set(as_dict(Settings()))


def test_settings_that_differ_are_listed_with_their_defaults(recording):
    settings = Settings()
    other = replace(settings, trajectory=replace(settings.trajectory, enabled=False))
    assert differing(settings) == []
    assert differing(other) == [("trajectory.enabled", "False", "True")]
    page = repeat_part(replace(recording, fit=replace(recording.fit, settings=as_dict(other))))
    assert "These settings differ" in page
    assert "trajectory.enabled" in page
