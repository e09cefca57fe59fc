"""The Review tab: proposals, flags, labels, what if."""
