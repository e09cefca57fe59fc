"""A made-up corpus: people, laboratories, faults and traps whose truth is known."""
