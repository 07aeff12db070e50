"""The version, where everybody can read it."""

VERSION = "0.1.0"
