"""The Queue tab: every trial with how much it needs a person."""
