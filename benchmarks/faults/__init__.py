"""Known faults edited into sound real recordings, and whether the diagnosis finds them."""
