"""The figures of Li, Yin and Deng (2009), made anew. Run them as ``python -m examples``.

A module is one figure: ``PAPER`` says what the paper shows, and ``draw`` returns the picture and what we see,
in a sentence with its figures. They need the Yale B folder and a folder of portraits with faces from the
front; where a light must be known on a colour photo, it is rendered (`examples.faces`).

`examples.lit` is no figure but a sheet of pairs, to be judged by eye: ``python -m examples lit``.
"""
