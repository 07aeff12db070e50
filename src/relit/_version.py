"""The version, in the one place that all others have it from."""

VERSION = "0.2.0"
