"""How near to the truth a result is."""
