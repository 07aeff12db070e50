"""Faces to train with: in random lights, or in none."""
