"""What can go wrong, as one tree of exceptions.

::

    RelitError
    ├── OptionError          an option or argument is not in its range        (also a ValueError)
    ├── ImageError           a photo cannot be read, written or used          (also a ValueError)
    ├── LandmarkError        landmarks are unusable or do not fit the image   (also a ValueError)
    │   └── FaceNotFoundError    no face, or not the one that was asked for
    ├── OutputError          a result cannot be put where it was asked to go  (also an OSError)
    └── WorkerLostError      the process that worked on something died
        └── ClusterLostError     so did what led all of them

Every message names the argument, says what was given and what was expected, and what to do next.
"""

from __future__ import annotations


class RelitError(Exception):
    """Base of every error that relit raises on purpose."""


class OptionError(RelitError, ValueError):
    """An option or argument is not in its range."""


class ImageError(RelitError, ValueError):
    """A photo cannot be read, written or used."""


class LandmarkError(RelitError, ValueError):
    """Landmarks are unusable or do not fit their image."""


class FaceNotFoundError(LandmarkError):
    """No face was found, or not the one that was asked for."""


class OutputError(RelitError, OSError):
    """A result cannot be put where it was asked to go."""


class WorkerLostError(RelitError):
    """The process that worked on something died: killed, out of memory, or crashed."""


class ClusterLostError(WorkerLostError):
    """Whatever led the workers is gone or out of reach, and all of them with it."""
