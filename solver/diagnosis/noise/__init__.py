"""What a sound recording's wrench balance may be off by."""
