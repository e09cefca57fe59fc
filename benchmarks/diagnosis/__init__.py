"""Diagnosis held to account: hidden effects, and whether they are found, named and measured."""
