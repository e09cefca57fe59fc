"""What a video's header says, on files that are made byte by byte."""

import struct

import pytest

from addb_viewer.app.scene.mp4 import Coded
from addb_viewer.app.subjects.video_header import VideoError, read_header
from tests.addb_viewer.app.synthetic_video import RATE, packed

PICTURES = [Coded(b"picture", True), Coded(b"another", False)]


def element(number, body, *, unknown=False):
    """Of EBML; one of unknown size is what a browser's recorder writes."""
    size = (1 << 56) - 1 if unknown else len(body)
    return bytes.fromhex(number) + struct.pack(">Q", (1 << 56) | size) + body


def webm(code=b"V_VP9", kind=1):
    track = (
        element("83", bytes([kind])) + element("86", code) + element("23E383", struct.pack(">I", 40_000_000))
    )
    sound = element("AE", element("83", b"\x02") + element("86", b"A_OPUS"))
    tracks = element("1654AE6B", sound + element("AE", track))
    return element("1A45DFA3", b"") + element("18538067", element("1549A966", b"info") + tracks, unknown=True)


@pytest.fixture
def header(tmp_path):
    def read(name, content):
        (tmp_path / name).write_bytes(content)
        return read_header(tmp_path / name)

    return read


@pytest.mark.parametrize(
    ("name", "content", "codec", "kind"),
    [
        ("a.mp4", packed(PICTURES), "VP9", "video/mp4"),
        ("a.MOV", packed(PICTURES, "avc1"), "H.264", "video/mp4"),
        (
            "big.mp4",
            struct.pack(">I4sQ", 1, b"mdat", 20) + b"1234" + packed(PICTURES, "avc1"),
            "H.264",
            "video/mp4",
        ),
        ("a.webm", webm(), "VP9", "video/webm"),
    ],
)
def test_what_browsers_play_is_found_with_its_rate(header, name, content, codec, kind):
    found = header(name, content)
    assert (found.codec, found.kind, found.rate) == (codec, kind, pytest.approx(RATE))


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.avi", b"RIFF", "browsers play MP4, MOV and WebM"),
        ("a.mp4", packed(PICTURES, "hvc1"), "coded as H.265"),
        ("a.mov", packed(PICTURES, "apcn"), "coded as ProRes"),
        ("a.webm", webm(b"V_AV1"), "coded as AV1"),
        ("a.webm", webm(kind=2), "header cannot be read"),
        ("a.mp4", packed(PICTURES).replace(b"vide", b"soun"), "header cannot be read"),
        ("a.mp4", b"", "header cannot be read"),
        ("a.webm", b"\x1a\x45\xdf\xa3\x00", "header cannot be read"),
        ("a.mp4", struct.pack(">I4sI4s", 16, b"moov", 2**31, b"trak"), "header cannot be read"),
    ],
)
def test_what_they_do_not_play_is_refused_with_the_command_that_converts_it(header, name, content, words):
    with pytest.raises(VideoError, match=words) as refused:
        header(name, content)
    assert f'ffmpeg -i "{name}"' in str(refused.value)


@pytest.mark.parametrize("cut", range(0, 700, 37))
def test_a_file_that_is_cut_off_ends_in_words(tmp_path, cut):
    for name, content in (("a.mp4", packed(PICTURES, "hvc1")), ("a.webm", webm(b"V_AV1"))):
        (tmp_path / name).write_bytes(content[:cut])
        with pytest.raises(VideoError):
            read_header(tmp_path / name)
