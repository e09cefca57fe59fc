"""Pictures of the app in ten states, at all sizes and in both themes."""
