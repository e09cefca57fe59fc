"""Texts of the solver as a reviewer reads them: bodies, coordinates and reasons in words."""

import re

from addb_viewer.text.coordinate_words import coordinates_told
from addb_viewer.text.diagnosis_vocabulary import BODIES, part_in_words
from annotations.reasons import REASONS, reason_words

_BODY = rf"(?:{'|'.join(BODIES)})_[rl]"
_ASIDE = re.compile(rf" \({_BODY}(?:(?:, |\+){_BODY})*\)")  # behind its words
_NAMED = re.compile(rf"\b{_BODY}\b")
_REASON = re.compile(rf"\b(?:{'|'.join(REASONS)})\b")


def in_plain_words(text: str) -> str:
    """With "right foot" in place of calcn_r, and the keys' words in place of a format's reasons."""
    text = _NAMED.sub(lambda found: part_in_words(found[0]), _ASIDE.sub("", coordinates_told(text)))
    return _REASON.sub(lambda found: reason_words(found[0]), text)
