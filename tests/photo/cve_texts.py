"""Landmarks, settings and manifests made after what once broke expat, JSON and CSV readers: our own bytes."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

    Files = Iterator[tuple[str, bytes]]

_PART = "<part name='{}' x='{}' y='{}'/>"
_PARTS = "".join(_PART.format(n, n * n, n) for n in range(3))


def _dlib(parts: str = _PARTS, before: str = "", box: str = "<box>") -> bytes:
    return f"{before}<dataset><images><image file='a'>{box}{parts}</box></image></images></dataset>".encode()


def trees() -> Files:
    """XML of expat's faults.

    As in CVE-2021-45960, CVE-2022-25235, -25313, CVE-2023-52425, CVE-2024-8176, CVE-2012-0876.
    """
    yield "plain.xml", _dlib()
    texts = {
        "entity-of-itself": _dlib(before="<!DOCTYPE d [<!ENTITY a '&b;'><!ENTITY b '&a;'>]>", parts="&a;"),
        "entity-for-parameters": _dlib(before="<!DOCTYPE d [<!ENTITY % a '<!ENTITY b \"x\">'>%a;%a;]>"),
        "entities-deep": _dlib(
            before="<!DOCTYPE d [<!ENTITY e0 ''>"
            + "".join(f"<!ENTITY e{n} '&e{n - 1};'>" for n in range(1, 20_000))
            + "]>",
            parts="&e19999;",
        ),
        "groups-in-groups": b"<!DOCTYPE d [<!ELEMENT d "
        + b"(" * 200_000
        + b"x"
        + b")" * 200_000
        + b">]><d/>",
        "attribute-defaults-many": _dlib(
            before="<!DOCTYPE d [<!ATTLIST part " + " ".join(f"a{n} CDATA ''" for n in range(20_000)) + ">]>"
        ),
        "a-long-token": b"<dataset a='" + b"x" * 3_500_000,
        "a-long-comment": b"<dataset><!--" + b"-x" * 1_700_000,
        "a-long-name": b"<" + b"a" * 3_000_000 + b"/>",
        "colons-in-names": b"<" + b"a:" * 1_000_000 + b"b/>",
        "namespace-with-a-separator": b"<dataset xmlns:a='x\x0cy' a:b='1'/>",
        "namespaces-many": b"<dataset " + b" ".join(b"xmlns:a%d='x'" % n for n in range(100_000)) + b"/>",
        "letters-cut": b"<dataset><\xc3/></dataset>",
        "letters-overlong": b"<dataset>\xc0\xbc\xe0\x80\xbc</dataset>",
        "surrogates": b"<dataset>\xed\xa0\x80</dataset>",
        "references-to-nothing": _dlib(parts="&#0;&#xD800;&#x110000;"),
        "reference-without-end": b"<dataset>&#" + b"9" * 1_000_000,
        "two-roots": _dlib() * 2,
        "text-behind": _dlib() + b"\0\0",
        "instruction-without-end": b"<?xml version='1.0'?><?x " + b"?" * 900_000,
        "version-9": _dlib(before="<?xml version='9.9'?>"),
        "encoding-changes": b"<?xml version='1.0' encoding='utf-16'?><dataset/>",
        "utf-16-cut": "<dataset/>".encode("utf-16")[:-1],
        "cdata-without-end": b"<dataset><![CDATA[" + b"]]" * 900_000,
        "part-of-no-name": _dlib(parts="<part x='1' y='2'/>" * 3),
        "part-names-same": _dlib(parts=_PART.format(0, 1, 2) * 3),
        "part-names-huge": _dlib(parts=_PART.format("9" * 5000, 1, 2)),
        "part-in-a-part": _dlib(parts=_PARTS.replace("/>", ">") + "</part>" * 3),
        "boxes-of-themselves": _dlib(box="<box>" * 300),
        "hashes-that-meet": b"<dataset "
        + b" ".join(b"%c%c%d=''" % (65 + n % 26, 97 + n // 26 % 26, n) for n in range(100_000))
        + b"/>",
    }
    for name, data in texts.items():
        yield f"{name}.xml", data


def objects() -> Files:
    """JSON that is deep, long or doubled.

    As in CVE-2020-36518 (Jackson), CVE-2020-10735 (Python), CVE-2013-6371 (json-c).
    """

    def points(text: str) -> bytes:
        return f'{{"version": 3, "groups": {{"a": {{"landmarks": {{"points": {text}}}}}}}}}'.encode()

    good = "[[1, 1], [2, 9], [7, 3]]"
    yield "plain.json", points(good)
    texts = {
        "digits-many": points(f"[[{'1' * 1_000_000}, 2], [3, 4], [5, 6]]"),
        "fraction-long": points(f"[[0.{'3' * 1_000_000}, 2], [3, 4], [5, 6]]"),
        "exponent-long": points(f"[[1e{'9' * 100_000}, 2], [3, 4], [5, 6]]"),
        "nested-in-turns": b'[{"a":' * 300_000,
        "keys-many": b'{"version": 3, "groups": {'
        + b",".join(b'"%d": 1' % n for n in range(300_000))
        + b"}}",
        "keys-same": b"{" + b'"groups": {},' * 200_000 + b'"version": 3}',
        "escapes-many": points(good).replace(b'"a"', b'"' + b"\\u0000" * 400_000 + b'"'),
        "escape-cut": b'{"version": "\\u12',
        "surrogate-alone": b'{"\\ud800": {"version": 3}}',
        "marks-twice": b"\xef\xbb\xbf\xef\xbb\xbf" + points(good),
        "utf-32": points(good).decode().encode("utf-32"),
        "comments": b"/* x */" + points(good),
        "numbers-of-python": points("[[1_0, 0x1], [+1, .5], [1., 01]]"),
        "prototype": b'{"__proto__": {"x": 1}, "constructor": {}, "version": 3, "groups": {}}',
        "class-of-python": b'{"py/object": "os.system", "version": 3}',
        "text-behind": points(good) + b"\0{}",
        "bare-word": b"NaN",
        "bytes-of-no-text": b'{"version": 3, "\xff\xfe": 1}',
        "points-of-4": points("[[1, 2, 3, 4], [1, 2, 3, 4], [5, 6, 7, 8]]"),
        "points-ragged": points("[[1, 2], [1], [5, 6, 7]]"),
        "points-of-objects": points('[{"x": 1}, [], null]'),
    }
    for name, data in texts.items():
        yield f"{name}.json", data


def lines() -> Files:
    """Tables of quotes, ends of lines and numbers gone wrong.

    As in CVE-2014-3524 (formulas) and what readers choke on.
    """
    rows = "1,1\n2,9\n7,3\n"
    for name, text in {
        "formula": '=cmd|"/c calc"!A1,1\n' + rows,
        "quotes-many": '"' * 900_000,
        "returns-only": "x,y\r" + rows.replace("\n", "\r"),
        "separators-of-lines": "x,y\u2028" + rows,
        "no-break": "x,y\n1\xa0,1\n2,9\n7,3\n",
        "full-width": "x,y\n\uff11,1\n2,9\n7,3\n",
        "header-only": "x,y\n",
        "columns-many": "x,y" + ",z" * 400_000,
        "semicolons": "x;y\n1;1\n2;9\n7;3\n",
        "decimal-commas": "x;y\n1,5;1\n2;9\n7;3\n",
        "signs": "x,y\n--1,1\n+-2,9\n7,3\n",
        "long-line": "x,y\n" + " " * 3_000_000 + "1,1\n",
    }.items():
        yield f"table-{name}.csv", text.encode()
    for name, text in {
        "count-negative": "version: 1\nn_points: -3\n{\n1 1\n2 9\n7 3\n}",
        "count-huge": f"n_points: {'9' * 100_000}\n{{\n1 1\n2 9\n7 3\n}}",
        "brace-missing": "version: 1\n{\n1 1\n2 9\n",
        "braces-backwards": "}\n1 1\n{\n",
        "nul": "{\n1 1\0\n2 9\n7 3\n}",
        "tabs": "{\n" + "\t" * 900_000 + "1 1\n}",
    }.items():
        yield f"points-{name}.pts", text.encode()
    for name, text in {
        "count-negative": "-3\n1 1\n",
        "count-huge": "9" * 100_000,
        "lines-huge": "3\n1 1\n2 9\n7 3\n999999999999\n",
        "lines-negative": "3\n1 1\n2 9\n7 3\n-1\n",
    }.items():
        yield f"template-{name}.tem", text.encode()


def settings() -> Files:
    """Settings and manifests that are deep, of another kind, or not what they say.

    As in as CVE-2020-36518, CVE-2020-14343.
    """
    texts = {
        "deep": b"[" * 1_000_000,
        "deep-options": b'{"options": ' + b'{"a":' * 100_000,
        "of-another-kind": b"[1, 2]",
        "yaml-object": b"!!python/object/apply:os.system ['true']",
        "toml": b"[options]\nstrength = 1\n",
        "option-of-an-object": b'{"options": {"strength": {"a": []}}}',
        "option-huge": b'{"options": {"strength": ' + b"9" * 100_000 + b"}}",
        "option-infinite": b'{"options": {"strength": 1e999, "lam": -Infinity, "fill": NaN}}',
        "option-of-no-name": b'{"options": {"__class__": 1, "": 2}}',
        "option-long": b'{"options": {"light": "' + b"+" * 1_000_000 + b'"}}',
        "lights-many": b'{"options": {"light": "' + b"+".join([b"rim"] * 100_000) + b'"}}',
        "landmarks-of-text": b'{"landmarks": {"target": "x"}}',
        "landmarks-of-nothing": b'{"landmarks": {"target": {"points": []}}}',
        "landmarks-of-a-scheme": b'{"landmarks": {"target": {"scheme": ["x"], "points": [[1, 2]]}}}',
        "landmarks-infinite": b'{"landmarks": {"target": {"points": [[1e999, 2], [3, 4], [6, 9]]}}}',
        "landmarks-nested": b'{"landmarks": {"target": {"points": ' + b"[" * 900 + b"]" * 900 + b"}}}",
        "no-text": b"\xff\xfe\xfd",
        "line-in-a-name": b'{"options": {"a\\nb": 1}}',
    }
    for name, data in texts.items():
        yield f"{name}.settings", data
    rows = {
        "deep": b"[" * 1_000_000 + b"\n",
        "digits": b'{"target": ' + b"9" * 100_000 + b"}\n",
        "many-blanks": b"\n" * 1_000_000,
        "nested-options": b'{"target": "a", "options": {"options": {"options": {}}}}',
        "nul": b'{"target": "a\\u0000b"}',
        "a-long-name": b'{"target": "' + b"a" * 1_000_000 + b'"}',
        "utf-16-cut": '{"target": "a"}'.encode("utf-16")[:-1],
    }
    for name, data in rows.items():
        yield f"rows-{name}.jsonl", data
    for name, data in {
        "magic-only": b"PAR1PAR1",
        "length-wild": b"PAR1" + b"\xff" * 4 + b"PAR1",
        "zeros": b"PAR1" + bytes(500) + struct_like() + b"PAR1",
    }.items():
        yield f"rows-{name}.parquet", data


def struct_like() -> bytes:
    """Return the length of a footer that is there and holds nothing."""
    return (400).to_bytes(4, "little")


PARTS = (trees, objects, lines, settings)
