"""The studio's HTTP API: what it gives is what the library gives, and nobody else's."""

import io
import json
import threading
import time
import zipfile
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from PIL import Image

from relit.cli import app as cli
from relit.face.landmark_files import read_landmarks
from relit.photo.reading import read_image
from relit.photo.samples import sample
from relit.relighting import transfer
from relit.settings.options import TransferOptions
from relit.settings_file import Settings, as_json, from_json
from relit.studio import pictures
from relit.studio.app import create_app
from relit.studio.sessions import Sessions
from tests.served import served
from tests.studio.api import API, png


class TestPhotos:
    def test_a_photo_comes_with_its_face(self, client, place):
        said = client.put(f"{place}/photos/target", content=sample("target").read_bytes()).json()
        assert (said["width"], said["height"], said["grey"], said["message"]) == (512, 512, False, None)
        marks = said["landmarks"]
        assert (marks["scheme"], len(marks["points"]), marks["detected"]) == ("mesh478", 478, True)
        assert set(marks["groups"]) > {"brows", "eyes", "nose", "mouth"}
        assert marks == client.get(f"{place}/landmarks/target").json()

    def test_it_is_shown_at_the_size_that_is_asked_for(self, client, place):
        answer = client.get(f"{place}/photos/reference", params={"side": 300})
        with Image.open(io.BytesIO(answer.content)) as picture:
            assert max(picture.size) <= 300
            assert picture.size[0] / picture.size[1] == pytest.approx(910 / 1137, abs=0.01)

    def test_without_a_face_points_are_placed_by_hand(self, client, place):
        wall = np.full((120, 160, 3), 90, np.uint8)
        said = client.put(f"{place}/photos/target", content=png(wall)).json()
        assert said["landmarks"] is None
        assert "place landmarks by hand" in said["message"]
        refused = client.post(f"{place}/render", json={})
        assert (refused.status_code, refused.json()["error"]["code"]) == (409, "no_face")
        points = [[40, 40], [80, 40], [60, 60], [50, 80], [70, 80]]
        for role in ("target", "reference"):
            answer = client.put(f"{place}/landmarks/{role}", json={"points": points})
            assert answer.json()["scheme"] == "points"
        assert client.post(f"{place}/render", json={}).status_code == 200

    @pytest.mark.parametrize(
        ("data", "said"),
        [
            (b"", "is empty"),
            (b"Dear diary", "found a text file"),
            (b"GIF89a" + bytes(100), "found a GIF file"),
            (sample("target").read_bytes()[:3000], "damaged or cut short"),
            (png(np.zeros((1, 1), np.uint8)), "cannot hold a face"),
        ],
    )
    def test_bad_uploads_get_a_clear_answer(self, client, place, data, said):
        answer = client.put(f"{place}/photos/target", content=data)
        assert answer.status_code == 400
        error = answer.json()["error"]
        assert error["code"] == "bad_photo"
        assert said in error["message"]
        assert client.get(f"{place}/landmarks/target").json()["scheme"] == "mesh478"  # the old one stays

    def test_what_is_transparent_is_seen_so(self, client, place):
        with Image.open(sample("target")) as photo:
            cut = photo.convert("RGB")
        alpha = np.full(cut.size[::-1], 255, np.uint8)
        alpha[:, :100], alpha[:60] = 0, 128
        rows, columns = np.indices(alpha.shape) // 8
        squares = np.where((rows + columns) % 2, 191, 230).astype(np.uint8)
        behind = Image.fromarray(squares).convert("RGB")
        expected = np.asarray(Image.composite(cut, behind, Image.fromarray(alpha)), float)
        cut.putalpha(Image.fromarray(alpha))
        client.put(f"{place}/photos/target", content=png(np.asarray(cut)))
        shown = client.get(f"{place}/photos/target", params={"side": 512})
        request = {"side": 512, "options": {"light": "loop", "strength": 0}}
        for answer in (shown, client.post(f"{place}/render", json=request)):
            with Image.open(io.BytesIO(answer.content)) as picture:
                assert np.abs(np.asarray(picture, float) - expected).mean() < 2, "a JPEG, but the same"

    def test_swapped_roles(self, client, place):
        said = client.post(f"{place}/swap").json()
        assert (said["target"]["width"], said["reference"]["width"]) == (910, 512)
        held = client.get(f"{place}/references").json()
        assert held[said["id"]]["width"] == 512, "the former target can be chosen again"
        again = client.post(f"{place}/swap").json()
        assert client.get(f"{place}/references").json().keys() >= {said["id"], again["id"]}
        third = client.post(f"{place}/swap").json()
        assert third["id"] == said["id"], "and is there once"


class TestLandmarks:
    @pytest.mark.parametrize("suffix", [".pts", ".tem", ".json", ".ljson", ".csv", ".xml"])
    def test_files_go_out_and_come_back(self, client, place, suffix, tmp_path):
        file = client.get(f"{place}/landmarks/target/file", params={"format": suffix})
        assert file.headers["content-disposition"].endswith(f'"target{suffix}"')
        (tmp_path / f"a{suffix}").write_bytes(file.content)
        points = np.array(client.get(f"{place}/landmarks/target").json()["points"])
        np.testing.assert_allclose(read_landmarks(tmp_path / f"a{suffix}").xy, points[:, :2], atol=1e-6)
        back = client.put(f"{place}/landmarks/target/file", params={"format": suffix}, content=file.content)
        np.testing.assert_allclose(np.array(back.json()["points"])[:, :2], points[:, :2], atol=1e-6)
        assert back.json()["detected"] is False
        again = client.post(f"{place}/landmarks/target/detect").json()
        np.testing.assert_array_equal(again["points"], points)

    @pytest.mark.parametrize(
        "points", [[], [[1, 1], [2, 2], [3, 3]], [[1, 1]], [[1], [2], [3]], [[5000, 1], [1, 5], [9, 9]]]
    )
    def test_unusable_points_are_refused(self, client, place, points):
        answer = client.put(f"{place}/landmarks/target", json={"points": points})
        assert answer.status_code == 400
        assert answer.json()["error"]["code"] == "bad_landmarks"
        assert answer.json()["error"]["message"].startswith("target_landmarks")


class TestRendering:
    def test_a_preview_is_what_the_library_makes_of_the_photo_at_that_size(self, client, place):
        answer = client.post(f"{place}/render", json={"options": {"strength": 0.7}, "side": 512})
        with Image.open(io.BytesIO(answer.content)) as opened:
            shown = np.asarray(opened).astype(float)
        photos = [read_image(sample(role)) for role in ("target", "reference")]
        whole = transfer(*photos, strength=0.7).image
        before = photos[0].pixels.astype(float)
        assert shown.shape == whole.shape
        # JPEG, a smaller reference, and less detail, of a change that is mild.
        assert np.abs(shown - whole).mean() < 3
        change, truth = (image - before for image in (shown, whole))
        face = np.abs(truth).max(axis=2) > 8
        assert np.corrcoef(change[face].ravel(), truth[face].ravel())[0, 1] > 0.75

    @pytest.mark.parametrize(("method", "own"), [("shading", "new_light"), ("ltv", "reference_u")])
    def test_every_view_is_a_picture(self, client, place, method, own):
        first = client.post(f"{place}/render", json={"options": {"method": method}})
        names = first.headers["x-relit-views"].split(",")
        assert {"result", "warped", "mask", "difference", own} <= set(names)
        for number, name in enumerate(names):
            answer = client.post(
                f"{place}/render", json={"options": {"method": method}, "view": name, "sequence": number}
            )
            Image.open(io.BytesIO(answer.content)).verify()
            left, top, width, height = (float(part) for part in answer.headers["x-relit-window"].split(","))
            assert 0 <= left < left + width <= 1 + 1e-6
            assert 0 <= top < top + height <= 1 + 1e-6

    def test_an_overtaken_request_is_stale(self, client, place):
        assert client.post(f"{place}/render", json={"sequence": 7}).status_code == 200
        answer = client.post(f"{place}/render", json={"sequence": 6})
        assert (answer.status_code, answer.json()["error"]["code"]) == (409, "stale")

    def test_a_request_at_work_is_called_off_by_a_newer_one(self, monkeypatch):
        store, entered, overtaken, finished = Sessions(), threading.Event(), threading.Event(), []

        def held_up(*args, **named):
            entered.set()
            assert overtaken.wait(120)
            finished.append(transfer(*args, **named))
            return finished[-1]

        monkeypatch.setattr(pictures, "transfer", held_up)
        with served(create_app(sessions=store)) as client, ThreadPoolExecutor(2) as clients:
            token = client.post(f"{API}/sessions").json()["session"]
            client.post(f"{API}/sessions/{token}/samples")

            def ask(sequence):
                return client.post(f"{API}/sessions/{token}/render", json={"sequence": sequence})

            older = clients.submit(ask, 1)
            assert entered.wait(120)
            newer = clients.submit(ask, 2)
            while store.get(token).newest < 2:
                time.sleep(0.01)
            overtaken.set()
            assert older.result().json()["error"]["code"] == "stale"
            assert newer.result().status_code == 200
        assert len(finished) == 1

    def test_a_quick_preview_is_about_the_fine_one_at_the_same_size(self, client, place):
        images = []
        for sequence, quick in enumerate((True, False)):
            wanted = {"side": 512, "quick": quick, "sequence": sequence}
            answer = client.post(f"{place}/render", json=wanted)
            with Image.open(io.BytesIO(answer.content)) as opened:
                images.append(np.asarray(opened).astype(float))
        before = read_image(sample("target")).pixels.astype(float)
        quick, fine = (image - before for image in images)
        face = np.abs(fine).max(axis=2) > 8
        assert np.corrcoef(quick[face].ravel(), fine[face].ravel())[0, 1] > 0.9
        assert np.abs(quick - fine).max() > 0

    @pytest.mark.parametrize(
        "options", [{"lam": -1}, {"nonsense": 1}, {"strength": "much"}, {"light": "sun"}, {"mask": "no"}]
    )
    def test_wrong_options_are_refused_by_name(self, client, place, options):
        for path in ("render", "export"):
            answer = client.post(f"{place}/{path}", json={"options": options})
            assert answer.status_code == 400
            assert answer.json()["error"]["code"] == "bad_option"
            assert answer.json()["error"]["message"].startswith(next(iter(options)))

    @pytest.mark.parametrize(
        ("asked", "suffix"),
        [
            *((suffix, suffix) for suffix in (".png", ".jpg", ".tif", ".ora", ".psd")),
            (".exr", ".layers.exr"),
        ],
    )
    @pytest.mark.rotating
    def test_the_command_line_makes_the_same_bytes_of_what_is_exported(
        self, client, place, asked, suffix, tmp_path, monkeypatch
    ):
        marks = client.get(f"{place}/landmarks/target").json()
        points = np.array(marks["points"])
        points[1] += [2.25, -1.5, 0]
        client.put(f"{place}/landmarks/target", json={"scheme": marks["scheme"], "points": points.tolist()})
        answer = client.post(
            f"{place}/export", json={"options": {"strength": 0.6, "tint": 0.25}, "format": asked}
        )
        with zipfile.ZipFile(io.BytesIO(answer.content)) as packed:
            assert set(packed.namelist()) == {
                f"relit{suffix}",
                "target.json",
                "reference.json",
                "settings.json",
            }
            packed.extractall(tmp_path)
        monkeypatch.chdir(tmp_path)
        photos = [str(sample(role)) for role in ("target", "reference")]
        with pytest.raises(SystemExit) as stop:
            cli.main(["transfer", *photos, "--config", "settings.json", "-o", f"again{suffix}"])
        assert stop.value.code == 0
        assert (tmp_path / f"again{suffix}").read_bytes() == (tmp_path / f"relit{suffix}").read_bytes()
        with pytest.raises(SystemExit):
            cli.main(
                ["transfer", *photos, "--config", "settings.json", "--strength", "0", "-o", f"none{suffix}"]
            )
        assert (tmp_path / f"none{suffix}").read_bytes() != (tmp_path / f"relit{suffix}").read_bytes()


class TestFailures:
    """Each of these has crashed a server, or was refused in another form."""

    @pytest.mark.parametrize(
        ("body", "status", "code"),
        [
            (b'{"options": {"self": 1}}', 400, "bad_option"),
            (b'{"options": {"lam": %s}}' % (b"9" * 400), 400, "bad_option"),
            (b'{"options": {"light": "\\ud800"}}', 400, "bad_option"),
            (b'{"options": {"\\ud800": 1}}', 400, "bad_option"),
            (b'{"options": {"strength": NaN}}', 400, "bad_option"),
            (b'{"options": {"light": "%s"}}' % (b"9" * 1_000_000), 400, "bad_option"),
            (b'{"options": %s1%s}' % (b'{"a":' * 9999, b"}" * 9999), 400, "bad_request"),
            (b'{"side": %s}' % (b"9" * 5000), 400, "bad_request"),
            (b'"\xff"', 400, "bad_request"),
            (b'\xff\xfe{"', 400, "bad_request"),
            (b'{"options":', 400, "bad_request"),
            (b"options", 400, "bad_request"),
            (b'{"side": Infinity}', 422, "bad_request"),
            (b'{"side": true}', 422, "bad_request"),
            (b'{"side": "640"}', 422, "bad_request"),
            (b'{"odd": 1}', 422, "bad_request"),
            (b"null", 422, "bad_request"),
            (b"{" + b" " * 5_000_000 + b"}", 413, "too_large"),
        ],
    )
    def test_what_is_no_request(self, client, place, body, status, code):
        answer = client.post(f"{place}/render", content=body, headers={"content-type": "application/json"})
        assert (answer.status_code, answer.json()["error"]["code"]) == (status, code)
        assert len(answer.json()["error"]["message"]) < 1100

    @pytest.mark.parametrize(
        ("path", "sent", "said"),
        [
            ("render", {"options": {"strength": None}}, "and at most 4, got nothing"),
            ("render", {"options": {"full_resolution": 3}}, "full_resolution: expected true or false, got 3"),
            ("landmarks/target", {"points": []}, "landmarks: expected points of 2 numbers each, or of 3"),
            ("landmarks/target", {"points": [[1], [1, 2]]}, "expected points of 2 numbers each, or of 3"),
        ],
    )
    def test_what_is_wrong_is_told_without_words_of_python(self, client, place, path, sent, said):
        answer = client.request("PUT" if "landmarks" in path else "POST", f"{place}/{path}", json=sent)
        assert answer.status_code == 400
        assert answer.json()["error"]["message"].endswith(said)

    @pytest.mark.parametrize("lam", [1e-5, 1e-300, 5e-324])
    def test_a_lambda_near_0_takes_no_longer_than_others(self, client, place, lam):
        begun = time.process_time()  # the server is in this process
        assert client.post(f"{place}/render", json={"options": {"lam": lam}, "side": 320}).status_code == 200
        assert time.process_time() - begun < 10  # it was minutes

    def test_other_places_and_methods(self, client, place):
        answer = client.get(f"{API}/nothing")
        assert (answer.status_code, answer.json()["error"]["code"]) == (404, "not_found")
        answer = client.patch(f"{place}/landmarks/target")
        assert (answer.status_code, answer.json()["error"]["code"]) == (405, "method_not_allowed")
        assert answer.headers["allow"] == "GET, PUT"

    def test_what_is_missing_is_said_apart_from_a_session_that_is(self, client):
        address = f"{API}/sessions/{client.post(f'{API}/sessions').json()['session']}"
        for method, path, status, code in (
            ("GET", f"{address}/photos/target", 404, "no_photo"),
            ("POST", f"{address}/swap", 409, "no_photo"),
            ("POST", f"{address}/export", 409, "no_photo"),
            ("GET", f"{API}/sessions/none/photos/target", 404, "not_found"),
        ):
            answer = client.request(method, path, json={} if path.endswith("export") else None)
            assert (answer.status_code, answer.json()["error"]["code"]) == (status, code)


class TestOptions:
    def test_they_are_those_of_the_library(self, client):
        said = client.get(f"{API}/options").json()
        assert [option["name"] for option in said["options"]] == list(TransferOptions.__dataclass_fields__)
        for option in said["options"]:
            field = TransferOptions.__dataclass_fields__[option["name"]]
            assert {key: option[key] for key in ("title", "group", "help")} == {
                key: field.metadata[key] for key in ("title", "group", "help")
            }
            assert option["default"] == field.default
            assert option["kind"] in {"choice", "number", "switch", "text"}


def test_settings_survive_their_file():
    marks = read_marks()
    settings = Settings(TransferOptions(lam=0.3, light="12,3", mask=False), target=marks)
    back = from_json(as_json(settings))
    assert back.options == settings.options
    np.testing.assert_array_equal(back.target.points, marks.points)
    assert back.target.scheme == marks.scheme
    assert back.reference is None
    assert json.loads(as_json(settings))["options"]["lam"] == 0.3


def read_marks():
    from relit.face.landmarks import Landmarks

    return Landmarks(np.random.default_rng(0).random((7, 3)) * 100 / 3)


@pytest.mark.parametrize(
    "data", [b"", b"[]", b"{", b'{"options": 3}', b'{"odd": 1}', b'{"landmarks": {"nose": {}}}', b"[" * 99999]
)
def test_what_is_no_settings_is_refused(data):
    from relit.errors import OptionError

    with pytest.raises(OptionError, match="settings: expected"):
        from_json(data)
