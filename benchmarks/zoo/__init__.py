"""Recordings as laboratories left them: what the first commands make of them, against what is so."""
