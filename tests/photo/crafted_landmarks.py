"""Landmark files made to harm: wild numbers, deep nesting, entities that multiply."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator


def landmarks() -> Iterator[tuple[str, bytes]]:
    points = b"1 1\n2 9\n7 3\n"
    yield "count-of-a-million-millions.pts", b"version: 1\nn_points: 1000000000000\n{\n" + points + b"}\n"
    yield "count-of-999999.tem", b"999999\n" + points
    yield "many-points.pts", b"{\n" + b"1 1\n2 9\n7 3\n" * 330_000 + b"}"
    yield "points-all-different.csv", b"x,y\n" + b"".join(b"%d,%d\n" % (i % 997, i) for i in range(400_000))
    yield "a-long-number.pts", b"{\n" + b"9" * 3_000_000 + b" 1\n}"
    yield "a-long-fraction.csv", b"x,y\n0." + b"7" * 100_000 + b",1\n2,9\n7,3\n"
    for name, value in {
        "e": b"1e999999999",
        "nan": b"sNaN",
        "inf": b"Infinity",
        "tiny": b"1e-999999999",
    }.items():
        for extension, text in {
            "pts": b"{\n%s 1\n2 9\n7 3\n}",
            "tem": b"3\n%s 1\n2 9\n7 3\n0",
            "csv": b"x,y\n%s,1\n2,9\n7,3",
        }.items():
            yield f"value-{name}.{extension}", text % value
    yield "comments.pts", b"#" * 4_000_000
    yield "braces.pts", b"{\n" * 2_000_000
    yield "blank-lines.tem", b"\x0b" * 4_000_000
    columns = 400_000
    yield "a-million-columns.csv", b",".join(b"x_%d" % i for i in range(columns)) + b"\n" + b"1," * columns
    yield (
        "many-openface-columns.csv",
        b",".join(b"x_%d,y_%d" % (i, i) for i in range(200_000)) + b"\n" + b"1," * columns,
    )
    yield "no-openface-columns.csv", b"x_0,y_00\n1,2\n"
    yield "same-columns.csv", b"x,x,y,y\n1,2,3,4\n2,3,4,9\n7,7,7,7\n"
    yield "many-cells.csv", b"x,y\n" + b"12,34\n" * 650_000
    yield "many-rows-of-commas.csv", b",,,,,,,\n" * 400_000
    yield "many-faces.csv", b"x_0,y_0\n" + b"1,2\n" * 1_000_000
    yield "open-quote.csv", b'x,y\n"' + b"1,2\n" * 900_000
    yield "too-large.csv", b"x,y\n" + b"1,2\n" * 1_100_000
    yield "nul.csv", b"x,y\n1\0,2\n"
    yield "a-field-without-end.csv", b"x,y\n" + b"1" * 200_000 + b",2\n"
    yield "two-byte-order-marks.csv", b"\xef\xbb\xbf" * 2 + b"x,y\n1,1\n2,9\n7,3\n"
    yield "utf-16.csv", "x,y\n1,1\n2,9\n7,3\n".encode("utf-16")

    def ljson(marks: str, more: str = "") -> bytes:
        return f'{{"version": 3, "groups": {{"a": {{"landmarks": {{"points": {marks}}}{more}}}}}}}'.encode()

    for name, value in {
        "1e400": "1e400",
        "nan": "NaN",
        "minus-infinity": "-Infinity",
        "huge": "9" * 4000,
        "longer-than-allowed": "9" * 5000,
        "true": "true",
        "text": '"12"',
        "lone-surrogate": '"\\ud800"',
        "deep": "[" * 500 + "]" * 500,
    }.items():
        yield f"value-{name}.json", ljson(f"[[1, {value}], [2, 9], [7, 3]]")
        yield f"depth-{name}.json", ljson("[[1, 1], [2, 9], [7, 3]]", f', "depth": [1, {value}, 2]')
        yield f"confidence-{name}.json", ljson("[[1, 1], [2, 9], [7, 3]]", f', "confidence": {value}')
    yield "nested-lists.json", b"[" * 4_000_000
    yield "nested-lists-that-close.json", b"[" * 2_000_000 + b"]" * 2_000_000
    yield "nested-objects.json", b'{"a":' * 800_000
    yield "nested-points.json", ljson("[" * 900 + "]" * 900)
    yield "many-points.json", ljson("[" + "[1,1],[2,9],[7,3]," * 200_000 + "[0,0]]")
    yield (
        "many-groups.json",
        (
            '{"version": 3, "groups": {'
            + ",".join(f'"{i}": {{"landmarks": {{"points": []}}}}' for i in range(80_000))
            + "}}"
        ).encode(),
    )
    yield "a-long-name.json", ljson("[[1, null], 2]").replace(b'"a"', b'"' + b"a\\n" * 1_000_000 + b'"')
    yield "many-empty-lists.json", b"[" + b"[]," * 1_300_000 + b"[]]"
    mask = '{"label": "mouth", "mask": %s}'
    rows = "[" + ", ".join(f"[{i}, {i * i}]" for i in range(68)) + "]"
    for name, label in {"huge": "9" * 400, "negative": "-1", "float": "1.5", "nested": "[[]]"}.items():
        masks = mask % f"[{label}]"
        yield f"mask-{name}.json", ljson(rows, f', "labels": [{masks}]')
    yield "version-of-lists.json", b'{"version": [[[1]]], "groups": []}'
    yield "version-1.json", b'{"version": 1, "groups": [{"landmarks": [{"point": [1, 2]}, 5]}, 7, null]}'

    part = "<part name='%s' x='%s' y='1'/>"
    box = "<dataset><images><image file='a'><box>%s</box></image></images></dataset>"
    laughs = "".join(f"<!ENTITY l{i} '{f'&l{i - 1};' * 10}'>" for i in range(1, 10))
    yield "billion-laughs.xml", f"<!DOCTYPE d [<!ENTITY l0 'ha'>{laughs}]><dataset>&l9;</dataset>".encode()
    yield (
        "laughs-in-attributes.xml",
        (f"<!DOCTYPE d [<!ENTITY l0 'ha'>{laughs}<!ATTLIST dataset a CDATA '&l9;'>]><dataset/>").encode(),
    )
    for place in ("file:///etc/passwd", "http://127.0.0.1:9/x"):
        text = f'<!DOCTYPE d [<!ENTITY e SYSTEM "{place}">]><dataset>&e;</dataset>'
        yield f"external-{place[:4]}.xml", text.encode()
        yield f"external-subset-{place[:4]}.xml", f'<!DOCTYPE d SYSTEM "{place}"><dataset/>'.encode()
    yield "unknown-entity.xml", (box % part % ("&e;", 1)).encode()
    yield "nested.xml", b"<dataset>" + b"<a>" * 1_300_000
    yield "nested-that-closes.xml", b"<dataset>" + b"<a>" * 550_000 + b"</a>" * 550_000 + b"</dataset>"
    yield "images-in-images.xml", b"<dataset>" + b"<image>" * 250_000 + b"</image>" * 250_000 + b"</dataset>"
    yield (
        "boxes-in-boxes.xml",
        b"<dataset><image>" + b"<box>" * 350_000 + b"</box>" * 350_000 + b"</image></dataset>",
    )
    yield "many-elements.xml", b"<dataset>" + b"<a/>" * 1_000_000 + b"</dataset>"
    yield (
        "many-attributes.xml",
        ("<dataset " + " ".join(f"a{i}=''" for i in range(380_000)) + "/>").encode(),
    )
    yield "many-parts.xml", (box % "".join(part % (i, i) for i in range(90_000))).encode()
    yield (
        "many-small-boxes.xml",
        (box % "").replace("<box></box>", ("<box>" + part % (0, 1) + "</box>") * 80_000).encode(),
    )
    for value in ("1e999", "nan", "\uff19", "1_0", ""):
        parts = part % (0, value) + part % (1, 2) + part % (2, 3)
        yield f"value-{value or 'none'}.xml", (box % parts).encode()
    for encoding in (
        "utf-7",
        "zip",
        "hex",
        "idna",
        "unicode_escape",
        "undefined",
        "utf-16",
        "ebcdic-cp-be",
        "x" * 9999,
    ):
        yield (
            f"encoding-{encoding[:20]}.xml",
            f"<?xml version='1.0' encoding='{encoding}'?><dataset/>".encode(),
        )
