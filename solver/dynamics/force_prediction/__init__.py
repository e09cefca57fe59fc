"""Ground forces of feet whose force was not measured."""
