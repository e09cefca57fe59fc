"""Force plates: geometry, zero level, sign, moments."""
