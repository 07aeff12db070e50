"""Options that would do nothing beside the method and the light that are chosen.

Of the exposure and the tint, only what cannot be had counts, and not what is so in any case.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from relit.settings.methods import METHODS
from relit.settings.studio_lights import studio_light

if TYPE_CHECKING:
    from relit.settings.options import TransferOptions

#: Options that not every method heeds, in the order in which methods name them.
OF_METHODS = tuple(dict.fromkeys(name for method in METHODS.values() for name in method.options))
#: Options of what is laid over the target.
_OF_REFERENCES = ("kernel", "affine", "smoothing", "split_first")


def idle(options: TransferOptions) -> dict[str, str]:
    """Return the fields that change no result of these options, each with what they do not go with.

    Examples
    --------
    >>> from relit.settings.options import TransferOptions
    >>> idle(TransferOptions(method="wls"))["turn"]
    "method 'wls'; leave it out, or choose method shading"
    >>> idle(TransferOptions(light="loop"))["kernel"]
    'a light by name; leave it out, or give a REFERENCE'
    """
    heeded = {*options.record.options}
    if options.lam == "auto" and "lam" in heeded:
        heeded.add("neighborhood")  # of the cut that finds λ
    if options.light is not None:
        heeded.add("fill")  # the light's own, before any method
    told = {}
    for name in OF_METHODS:
        if name not in heeded:
            others = " or ".join(other for other, method in METHODS.items() if name in method.options)
            told[name] = f"method {options.method!r}; leave it out, or choose method {others}"
    if options.light is not None:
        lit = "a light by name; leave it out, or give a REFERENCE"
        told |= dict.fromkeys(_OF_REFERENCES, lit)
        if options.exposure == "take" and options.record.anchors_itself:
            told["exposure"] = lit
        if options.tint_share and not studio_light(options.light).colored:  # none is what such a light gives
            told["tint"] = "a white light; leave it out, or give the light a colour"
    return told
