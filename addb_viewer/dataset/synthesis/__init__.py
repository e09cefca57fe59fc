"""A synthetic corpus: people, laboratories, faults and traps whose truth is known."""
