"""Whether a release is whole, obeys its schema and F = ma, is plausible, and holds nothing twice."""
