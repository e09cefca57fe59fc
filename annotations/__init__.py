"""What people decided about a recording: flags, labels and status. Knows no numerics."""
