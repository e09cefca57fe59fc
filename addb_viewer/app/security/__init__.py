"""The web server, and what it lets in: requests, pages, values, messages."""
