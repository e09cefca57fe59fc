"""A fit as one page to hand over: opens offline, plays, prints."""
