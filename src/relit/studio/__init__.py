"""The studio: a local web page to relight by hand and eye, and the HTTP API under it."""
