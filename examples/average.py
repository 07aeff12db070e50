"""The average error over four subjects, the paper's one figure of quality."""

from __future__ import annotations

from typing import TYPE_CHECKING

from relit import TransferOptions
from relit.evaluate.cases import protocol_cases
from relit.evaluate.evaluation import evaluate, images_of
from relit.evaluate.figure import truth_figure
from relit.evaluate.summaries import summaries
from relit.runtime.threads import available

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from examples.faces import Faces

PAPER = "8.69 % mean absolute error over four subjects of Yale B, which it does not name."
EVERY = 3  # of the protocol's cases


def draw(faces: Faces) -> tuple[NDArray[np.uint8], str]:
    """Average over four subjects of like complexion, and show one case of each."""
    cases = protocol_cases(faces.yaleb / "protocol.csv", "paper4")[::EVERY]
    methods = {"ltv": TransferOptions(method="ltv")}
    outcomes = [o for found in evaluate(cases, methods, folder=faces.yaleb, jobs=available()) for o in found]
    raw = {line.method: line for line in summaries(outcomes) if (line.group, line.figure) == ("all", "raw")}
    shown = {case.target[0]: case for case in cases}
    rows = [(name, images_of(case, methods, faces.yaleb)[0], "ltv") for name, case in shown.items()]
    ltv, refcopy = raw["ltv"], raw["refcopy"]
    ours = (
        f"{ltv.mean:.2f} % ({ltv.low:.2f} to {ltv.high:.2f}) over {ltv.cases} transfers between "
        f"{', '.join(shown)}; the reference merely laid over the target gives {refcopy.mean:.2f} %."
    )
    return truth_figure(rows), ours
