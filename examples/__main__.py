"""Draw the figures, and say under each what the paper shows and what we see."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from examples import lit, sliders
from examples.faces import Faces
from examples.gallery import FIGURES, figure
from relit import RelitError, write_image


def main() -> None:
    """Read the arguments, draw, write."""
    parser = argparse.ArgumentParser(
        prog="python -m examples",
        description=f"{__doc__} `lit --help` tells of pairs, `sliders --help` of the docs' pictures.",
    )
    parser.add_argument("figures", nargs="*", metavar="FIGURE", help=f"default: all of {', '.join(FIGURES)}")
    parser.add_argument(
        "--yaleb", type=Path, required=True, help="Yale B faces, in the layout of CroppedYale"
    )
    parser.add_argument("--portraits", type=Path, required=True, help="colour portraits NNN_03.jpg")
    parser.add_argument("-o", "--output", type=Path, default=Path("gallery"), help="folder to write to")
    given = parser.parse_args()
    for name in given.figures:
        if name not in FIGURES:
            parser.error(f"no figure {name!r}; expected some of {', '.join(FIGURES)}")
    given.output.mkdir(parents=True, exist_ok=True)
    faces = Faces(given.yaleb, given.portraits)
    pages = []
    for name in given.figures or FIGURES:
        try:
            paper, picture, ours = figure(name, faces)
        except RelitError as error:
            parser.error(str(error))
        write_image(given.output / f"{name}.png", picture, overwrite=True)
        pages.append(f"## {name}\n\n![]({name}.png)\n\nThe paper: {paper}\n\nWe: {ours}\n")
        print(pages[-1], flush=True)
    (given.output / "README.md").write_text("# The paper's figures\n\n" + "\n".join(pages), encoding="utf-8")


if __name__ == "__main__":
    if sys.argv[1:2] == ["lit"]:
        lit.main(sys.argv[2:])
    elif sys.argv[1:2] == ["sliders"]:
        sliders.main(sys.argv[2:])
    else:
        main()
