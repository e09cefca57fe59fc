"""Labels on the wrong trajectory for a while: found by the distances within segments, repaired or masked."""
