"""Landmark files written by hand, all of the same face."""

from __future__ import annotations

from pathlib import Path

import numpy as np

EXTENSIONS = [".pts", ".tem", ".json", ".ljson", ".csv", ".xml"]

# No symmetry, so that swapped axes, another origin or another order cannot pass.
FACE = [[30.0, 40.0], [70.5, 42.0], [51.0, 81.25], [12.0, 9.0]]
DEPTH = [3.0, -4.5, 0.0, 7.0]

# fmt: off
PTS = "version: 1\nn_points: 4\n{\n31 41\n71.5 43\n52 82.25\n13 10\n}\n"
TEM = "4\n30\t40\n70.5\t42\n51\t81.25\n12\t9\n1\n0\n3\n0 1 2\n"
GROUP = '{"labels": [], "landmarks": {"points": [[40, 30], [42, 70.5], [81.25, 51], [9, 12]]}}'
JSON = '{"version": 3, "groups": {"a": ' + GROUP + "}}"
CSV = "x,y\n30,40\n70.5,42\n51,81.25\n12,9\n"
OPENFACE = (
    "frame, face_id, timestamp, confidence, success, x_0, x_1, x_2, x_3, y_0, y_1, y_2, y_3, X_0, Y_0, Z_0\n"
    "1, 0, 0.000, 0.98, 1, 30, 70.5, 51, 12, 40, 42, 81.25, 9, -1, -2, 500\n"
)

PARTS = (
    "<part name='00' x='30' y='40'/><part name='01' x='70.5' y='42'/>"
    "<part name='02' x='51' y='81.25'/><part name='03' x='12' y='9'/>"
)

XML = (
    "<dataset><images><image file='a.jpg'><box top='1' left='2' width='3' height='4'>"
    f"{PARTS}</box></image></images></dataset>"
)

BY_HAND = {
    "plain.pts": PTS,
    "messy.PTS": (
        "\ufeff// by hand\r\nN_Points :  4 \t\r\n\r\n{\t\r\n"
        " 31\t41 # eye\r\n\r\n71.5 43 // eye\r\n52 8.225e1\r\n13 10\r\n}"
    ),
    "no_count.pts": "{\n31 41\n71.5 43\n52 82.25\n13 10\n}\n",
    "plain.tem": TEM,
    "spaces.tem": "# by hand\r\n4\r\n30 40\r\n\r\n70.5   42\r\n51 81.25\r\n12 9\r\n0\r\n",
    "webmorph.tem": TEM + '0\n\n{"last_saved": "2014-01-01"}\n',
    "version_3.json": JSON,
    "version_3.ljson": JSON,
    "version_2.json": (
        '{"version": 2, "labels": [{"label": "all", "mask": [0, 1, 2, 3]}], "landmarks":'
        '{"connectivity": [[0, 1]], "points": [[40, 30], [42, 70.5], [81.25, 51], [9, 12]]}}'
    ),
    "version_1.json": (
        '{"version": 1, "groups": [{"label": "eyes", "connectivity": [[0, 1]], "landmarks":'
        '[{"point": [40, 30]}, {"point": [42, 70.5]}]}, {"label": "rest", "landmarks":'
        '[{"point": [81.25, 51]}, {"point": [9, 12]}]}]}'
    ),
    "plain.csv": CSV,
    "no_header.csv": "30,40\r\n70.5,42\r\n51,81.25\r\n12,9",
    "named.csv": '# by hand\nname, Y, X,\n"eye, right",40,30\neye,42,70.5,\nmouth,81.25,51\n\near,9,12\n,,\n',
    "openface.csv": OPENFACE,
    "image.csv": (
        "face, confidence, x_0, x_1, x_2, x_3, y_0, y_1, y_2, y_3\n"
        "0, 0.98, 30, 70.5, 51, 12, 40, 42, 81.25, 9\n"
    ),
    "byte_order_mark.csv": "\ufeff" + CSV,
    "plain.xml": XML,
    "unsorted.xml": XML.replace(PARTS, (
        "<part name='11' x='51' y='81.25'/><part name='9' x='30' y='40'/>"
        "<part name='12' x='12' y='9'/><part name='10' x='70.5' y='42'/>"
    )),
    "long_name.xml": XML.replace("03", "9" * 5000),
    "words.xml": XML.replace(PARTS, (
        "<part name='c' x='51' y='81.25'/><part name='a' x='30' y='40'/>"
        "<part name='ear' x='12' y='9'/><part name='b' x='70.5' y='42'/>"
    )),
}
# fmt: on


def save(folder: Path, name: str, content: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def scattered(count: int, dimensions: int = 2) -> np.ndarray:
    return np.random.default_rng(count).normal(200, 100, (count, dimensions))
