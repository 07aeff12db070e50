"""Photos and results where code is written: in notebooks and terminals."""
