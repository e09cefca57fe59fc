"""Errors for people: every message says where, what is wrong, and what to do."""


class ReviewError(Exception):
    """A review cannot be recorded or read as it is."""


class LostLogError(ReviewError):
    """The log's file was replaced, deleted or written over while open; nothing is recorded any more."""
