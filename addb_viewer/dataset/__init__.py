"""A release: folders of reviewed subjects as files that others load."""
