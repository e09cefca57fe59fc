"""The page's shell."""

import base64
import hashlib
import html
import re

from addb_viewer.report.markup import Safe
from addb_viewer.report.report_page import page_html


def policy_of(page):
    return html.unescape(re.search(r'Content-Security-Policy" content="([^"]+)"', page)[1])


def test_only_the_scripts_that_were_put_there_may_run():
    page = page_html("A", Safe("<p>b</p>"), ("sort.js", "player.js"))
    allowed = set(re.findall("'sha256-([^']+)'", policy_of(page)))
    scripts = re.findall(r"<script>(.*?)</script>", page, re.S)
    assert len(scripts) == 2
    digests = {base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts}
    assert digests == allowed
    assert "script-src 'none'" in policy_of(page_html("A", Safe("")))


def test_nothing_outside_the_page_may_be_reached():
    assert policy_of(page_html("A", Safe(""))).startswith("default-src 'none'; img-src data:;")
    page = page_html("A", Safe(""), ("sort.js", "player.js"))
    assert not re.search(r"""(?:https?:)?//[a-z]+\.[a-z]""", page)


def test_the_title_is_text():
    assert "<title>&lt;b&gt;</title>" in page_html("<b>", Safe(""))
