"""Pictures of the app in several states, at all sizes and in both themes."""
