"""Faces in random lights, to train with."""
