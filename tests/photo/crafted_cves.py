"""Files made after known faults of other libraries, by the class of fault: over 300, of our own bytes.

A name tells what is wrong with a file; the docstring of what makes it, which faults it is modelled after.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cve_cameras
import cve_exrs
import cve_jpegs
import cve_pngs
import cve_profiles
import cve_rasters
import cve_texts
import cve_tiff_pixels
import cve_tiffs

if TYPE_CHECKING:
    from collections.abc import Iterator


def cves() -> Iterator[tuple[str, bytes]]:
    """Yield every one, by its name."""
    photos = (cve_tiffs, cve_tiff_pixels, cve_pngs, cve_jpegs, cve_rasters, cve_exrs, cve_cameras)
    for module in (*photos, cve_profiles, cve_texts):
        for part in module.PARTS:
            for name, data in part():
                yield f"cve-{name}", data
