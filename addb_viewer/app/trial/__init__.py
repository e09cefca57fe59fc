"""One trial without a page: its arrays, what detection proposes, what people said about it."""
