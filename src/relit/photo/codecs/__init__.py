"""Photo codecs: from bytes to samples and back, one format a file."""
