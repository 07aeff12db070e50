"""The studio: a local web page to relight interactively, and the HTTP API under it."""
