"""Laying the reference over the target (Sect. 3 of Li, Yin and Deng, 2009)."""
