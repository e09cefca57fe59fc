"""What a subject's description says, in the texts of a release: as words, whatever signs it has."""

import pytest

from addb_viewer.dataset.release_texts import citations, licences


@pytest.mark.parametrize(
    "source", ["a | b", "<script>x</script>", "[x](javascript:y)", "`a`", "two\nlines", "a\\|b"]
)
def test_a_source_is_one_cell_of_words(source):
    row = {"source": source, "licence": "CC-BY-4.0", "consent": "public", "url": "https://x.org/|a"}
    *_, line, end = licences([row]).split("\n")
    assert end == ""
    cells = line.replace("\\\\", "").replace("\\|", "").split("|")
    assert len(cells) == 6, "four cells between five bars"
    for sign in "<>`[]":
        assert sign not in line.replace(f"\\{sign}", "")


def test_braces_of_a_source_end_no_citation():
    text = citations([{"source": "a} {b", "citation": "Somebody {2024}"}])
    assert text.count("{") == text.count("}") == 3
