"""How code runs: compiled, in threads, remembered, timed."""
