"""Colours, and pieces of HTML that several panels share."""
