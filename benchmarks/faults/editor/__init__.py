"""Reads and rewrites laboratories' files by itself: what is judged takes no part in making the cases."""
