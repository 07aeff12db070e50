"""References at hand: kept, shown, chosen, and counted."""

import io
import json
import zipfile

import numpy as np
import pytest
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from relit.photo.samples import sample
from relit.settings.studio_lights import STUDIO_LIGHTS
from relit.studio.sessions import ASIDE, MOST_REFERENCES
from tests.studio.api import API, png

PHOTO = sample("reference").read_bytes()


def preview(client, place, **asked):
    answer = client.post(f"{place}/render", json={"side": 160, **asked})
    return answer.content if answer.status_code == 200 else answer.json()["error"]["code"]


def test_a_reference_at_hand_gives_the_light_that_it_gives_as_the_sessions_own(client, place):
    facts = client.put(f"{place}/references/of_target", content=sample("target").read_bytes()).json()
    assert facts == client.get(place).json()["target"]
    assert client.get(f"{place}/references").json()["of_target"] == facts
    own = preview(client, place)
    other = preview(client, place, reference="of_target")
    assert own != other
    assert preview(client, place) == own
    chosen = client.post(f"{place}/references/of_target/choose").json()
    assert chosen["reference"] == facts == chosen["target"]
    assert preview(client, place) == other
    assert list(client.get(f"{place}/references").json()) == ["sample", "of_target"]


def test_its_photo_is_returned_as_small_as_asked(client, place):
    client.put(f"{place}/references/one", content=PHOTO)
    answer = client.get(f"{place}/references/one/photo?side=200")
    assert answer.content == client.get(f"{place}/photos/reference?side=200").content
    with Image.open(io.BytesIO(answer.content)) as photo:
        assert max(photo.size) <= 200


def test_what_is_deleted_is_gone_and_was_chosen_all_the_same(client, place):
    client.put(f"{place}/references/one", content=PHOTO)
    client.post(f"{place}/references/one/choose")
    assert client.delete(f"{place}/references/one").status_code == 204
    for answer in (
        client.delete(f"{place}/references/one"),
        client.get(f"{place}/references/one/photo"),
        client.post(f"{place}/references/one/choose"),
    ):
        assert (answer.status_code, answer.json()["error"]["code"]) == (404, "no_photo")
    assert preview(client, place, reference="one") == "no_photo"
    assert client.get(f"{place}/photos/reference").status_code == 200


def test_one_without_a_face_is_kept_and_gives_no_light(client, place):
    facts = client.put(f"{place}/references/plain", content=png(np.full((90, 80), 99, np.uint8))).json()
    assert facts["landmarks"] is None
    assert "place landmarks by hand" in facts["message"]
    assert preview(client, place, reference="plain") == "no_face"


def test_there_are_so_many_and_no_more(client):
    place = f"{API}/sessions/{client.post(f'{API}/sessions').json()['session']}"
    photo = png(np.zeros((9, 9), np.uint8))
    for number in range(MOST_REFERENCES):
        assert client.put(f"{place}/references/{number}", content=photo).status_code == 200
    answer = client.put(f"{place}/references/more", content=photo)
    assert (answer.status_code, answer.json()["error"]["code"]) == (409, "full")
    assert client.put(f"{place}/references/{ASIDE}", content=photo).status_code == 200, "beside them"
    assert client.put(f"{place}/references/3", content=photo).status_code == 200
    client.delete(f"{place}/references/3")
    assert client.put(f"{place}/references/more", content=photo).status_code == 200


@pytest.mark.parametrize("name", ["a b", "a.png", "x" * 41, "é"])
def test_other_names_are_refused(client, place, name):
    assert client.put(f"{place}/references/{name}", content=PHOTO).status_code == 422
    assert client.post(f"{place}/render", json={"reference": name}).status_code == 422


def test_what_is_no_photo_is_refused(client, place):
    answer = client.put(f"{place}/references/one", content=b"no photo")
    assert (answer.status_code, answer.json()["error"]["code"]) == (400, "bad_photo")
    assert list(client.get(f"{place}/references").json()) == ["sample"]


def test_thumbnails_leave_the_sequence_of_previews_alone(client, place):
    assert client.post(f"{place}/render", json={"sequence": 7, "quick": True}).status_code == 200
    assert client.post(f"{place}/render", json={"side": 160, "sequence": 3}).status_code == 200
    assert client.post(f"{place}/render", json={"side": 160, "sequence": 9}).status_code == 200
    assert client.post(f"{place}/render", json={"sequence": 8, "quick": True}).status_code == 200


def test_a_photo_at_hand_is_exported_in_the_light_of_the_session(client, place):
    """As the session's own target is, and without that being touched."""
    client.put(f"{place}/references/other", content=PHOTO)
    before = client.get(place).json()
    answer = client.post(f"{place}/export", json={"target": "other", "format": ".png"})
    assert client.get(place).json() == before
    client.put(f"{place}/photos/target", content=PHOTO)
    packed = client.post(f"{place}/export", json={"format": ".png"})
    with zipfile.ZipFile(io.BytesIO(packed.content)) as archive:
        assert answer.content == archive.read("relit.png")
    assert json.loads(answer.headers["X-Relit-Not-Kept"]) == []
    missing = client.post(f"{place}/export", json={"target": "nobody"})
    assert (missing.status_code, missing.json()["error"]["code"]) == (409, "no_photo")


def test_an_export_names_what_its_format_cannot_hold(client, place):
    buffer, texts = io.BytesIO(), PngInfo()
    texts.add_text("Title", "A face")
    with Image.open(sample("target")) as photo:
        photo.putalpha(200)
        photo.save(buffer, "PNG", pnginfo=texts, dpi=(300, 300))
    client.put(f"{place}/photos/target", content=buffer.getvalue())
    client.put(f"{place}/references/seen", content=buffer.getvalue())
    for suffix, lost in ((".png", []), (".jpg", ["transparency", "text (Title)"])):
        for asked in ({}, {"target": "seen"}):
            answer = client.post(
                f"{place}/export", json={"options": {"light": "loop"}, "format": suffix, **asked}
            )
            assert json.loads(answer.headers["X-Relit-Not-Kept"]) == lost


def test_lights_by_name_are_told_with_their_places(client):
    told = client.get("/api/v1/options").json()["lights"]
    assert list(told) == list(STUDIO_LIGHTS)
    assert told["split"] == {"azimuth": -75, "elevation": 5, "size": 10}


def test_an_export_has_the_light_of_the_reference_that_it_names_whatever_is_chosen_meanwhile(client, place):
    client.put(f"{place}/references/of_target", content=sample("target").read_bytes())
    client.put(f"{place}/references/other", content=PHOTO)
    own = {"target": "other", "format": ".png"}
    before = client.post(f"{place}/export", json=own).content
    client.post(f"{place}/references/of_target/choose")
    assert client.post(f"{place}/export", json=own).content != before
    assert client.post(f"{place}/export", json={**own, "reference": "sample"}).content == before
    packed = client.post(f"{place}/export", json={"format": ".png", "reference": "sample"}).content
    client.post(f"{place}/references/sample/choose")
    again = client.post(f"{place}/export", json={"format": ".png"}).content
    for name in ("relit.png", "reference.json", "settings.json"):
        one, other = (zipfile.ZipFile(io.BytesIO(data)).read(name) for data in (packed, again))
        assert one == other
    missing = client.post(f"{place}/export", json={**own, "reference": "nobody"})
    assert (missing.status_code, missing.json()["error"]["code"]) == (409, "no_photo")


def test_landmarks_of_a_photo_at_hand_are_placed_as_the_targets_are(client, place):
    client.put(f"{place}/references/film", content=sample("target").read_bytes())
    marks = client.get(f"{place}/landmarks/target").json()
    points = [[x + 9, y, *z] for x, y, *z in marks["points"]]
    placed = {"scheme": marks["scheme"], "points": points}
    found = client.post(f"{place}/export", json={"target": "film"}).content
    assert client.put(f"{place}/references/film/landmarks", json=placed).json()["points"] == points
    client.put(f"{place}/landmarks/target", json=placed)
    moved = client.post(f"{place}/export", json={"target": "film"}).content
    with zipfile.ZipFile(io.BytesIO(client.post(f"{place}/export", json={}).content)) as archive:
        assert archive.read("relit.png") == moved != found
    outside = client.put(f"{place}/references/film/landmarks", json={"points": [[1, 1], [2, 1], [9e5, 2]]})
    assert (outside.status_code, outside.json()["error"]["code"]) == (400, "bad_landmarks")


def test_a_set_is_relit_by_a_session_without_a_target(client):
    address = f"{API}/sessions/{client.post(f'{API}/sessions').json()['session']}"
    client.put(f"{address}/references/film", content=PHOTO)
    answer = client.post(f"{address}/export", json={"options": {"light": "loop"}, "target": "film"})
    assert answer.status_code == 200
