"""The queue's page as the browser gets it: no framework, nothing evaluated, names and texts as text nodes."""
