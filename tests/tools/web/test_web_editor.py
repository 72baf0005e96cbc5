"""Missions are edited in the page: opened, checked as they are typed, and saved as a whole or not at all."""

from __future__ import annotations

import sys

import pytest
from starlette.testclient import TestClient

from nxtdrive.tools.web.editor import MAX_BYTES
from tests.tools.web.pages import client_of, server_of

GOOD = '[mission]\nname = "é"\ntargets = ["lena"]\n[target.lena]\ndetector = "picture"\npictures = ["lena.png"]\n'


@pytest.fixture
def client(tmp_path) -> TestClient:
    return client_of(server_of(tmp_path))


def _files(folder) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_mission_is_opened_changed_and_saved(client, tmp_path):
    (tmp_path / "cat.toml").write_text(GOOD, encoding="utf-8")
    assert client.get("/api/missions").json() == ["cat.toml"]
    opened = client.get("/api/missions/cat.toml").json()
    assert opened["text"] == GOOD
    changed = {"text": GOOD + "# ü\n", "version": opened["version"]}
    saved = client.put("/api/missions/cat.toml", json=changed)
    assert saved.status_code == 200
    assert (tmp_path / "cat.toml").read_bytes() == (GOOD + "# ü\n").encode()
    again = {"text": GOOD, "version": saved.json()["version"]}
    assert client.put("/api/missions/cat.toml", json=again).status_code == 200
    assert _files(tmp_path) == ["cat.toml"]


def test_the_page_does_not_name_a_module_to_run(client, tmp_path):
    own = GOOD.replace("[target", 'profile = "my_profile:Profile"\n[target', 1)
    for text in (own, own.replace("my_profile:Profile", "os:path"), f"\ufeff{own}"):
        refused = client.put("/api/missions/dog.toml", json={"text": text, "version": ""})
        assert refused.status_code == 422
        assert "Write it into the file there" in refused.text
    assert not _files(tmp_path)
    (tmp_path / "cat.toml").write_text(own, encoding="utf-8")
    version = client.get("/api/missions/cat.toml").json()["version"]
    other = {"text": own.replace("my_profile:Profile", "os:path"), "version": version}
    assert client.put("/api/missions/cat.toml", json=other).status_code == 422
    assert client.put("/api/missions/cat.toml", json={"text": own + "# ü\n", "version": version}).status_code == 200


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such permissions")
def test_a_saved_file_keeps_its_permissions(client, tmp_path):
    (tmp_path / "cat.toml").write_text(GOOD, encoding="utf-8")
    (tmp_path / "cat.toml").chmod(0o640)
    version = client.get("/api/missions/cat.toml").json()["version"]
    client.put("/api/missions/cat.toml", json={"text": "", "version": version})
    client.put("/api/missions/dog.toml", json={"text": GOOD, "version": ""})
    (tmp_path / "usual").touch()
    modes = {name: (tmp_path / name).stat().st_mode for name in ("cat.toml", "dog.toml", "usual")}
    assert modes["cat.toml"] & 0o777 == 0o640
    assert modes["dog.toml"] == modes["usual"]


def test_the_template_is_a_good_mission_and_makes_a_new_one(client, tmp_path):
    text = client.get("/api/template").text
    assert client.post("/api/check", json={"text": text}).json()["mistakes"] == []
    assert client.put("/api/missions/my mission-2.toml", json={"text": text, "version": ""}).status_code == 200
    assert _files(tmp_path) == ["my mission-2.toml"]


@pytest.mark.parametrize("version", ["", "of another text"])
@pytest.mark.parametrize("there", [True, False])
def test_a_file_that_is_not_what_it_was_is_not_written(client, tmp_path, there, version):
    if there:
        (tmp_path / "cat.toml").write_text(GOOD, encoding="utf-8")
    answer = client.put("/api/missions/cat.toml", json={"text": "mine", "version": version})
    written = not there and not version
    assert answer.status_code == (200 if written else 409)
    assert not written or _files(tmp_path) == ["cat.toml"]
    if there:
        assert (tmp_path / "cat.toml").read_text(encoding="utf-8") == GOOD
    assert len(_files(tmp_path)) == (there or written)


@pytest.mark.parametrize(
    "name",
    [
        "con.toml",
        "LPT1.old.toml",
        "cat.txt",
        ".toml",
        ".hidden.toml",
        "..toml",
        "a%2Fb.toml",
        "..%2Fsecret.toml",
        "a%5Cb.toml",
        "a%00.toml",
        "a" * 251 + ".toml",
        "é" * 126 + ".toml",
    ],
)
def test_only_mission_files_of_the_folder_are_written(client, tmp_path, name):
    before = _files(tmp_path.parent)
    assert client.put(f"/api/missions/{name}", json={"text": GOOD, "version": ""}).status_code in (404, 405, 422)
    assert (_files(tmp_path), _files(tmp_path.parent)) == ([], before)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "mission"),
        ("[mission", "TOML"),
        (GOOD.replace("lena.png", "nosuch.png"), "nosuch.png"),
        (GOOD.replace("targets", "target"), "targets"),
    ],
)
def test_mistakes_are_reported_without_a_file(client, tmp_path, text, says):
    found = client.post("/api/check", json={"text": text}).json()
    assert any(says in mistake for mistake in found["mistakes"])
    assert not any("draft" in mistake for mistake in found["mistakes"])
    assert _files(tmp_path) == []


def test_pictures_beside_the_mission_are_found_and_a_good_mission_has_no_mistakes(client):
    assert client.post("/api/check", json={"text": GOOD}).json() == {"mistakes": [], "warnings": []}


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (b"", 422),
        (b"{}", 422),
        (b'{"text": 1}', 422),
        (b"[" * 5000, 422),
        (b"\xff", 422),
        (b"x" * (MAX_BYTES + 1), 413),
    ],
)
def test_other_bodies_are_refused(client, body, status):
    assert client.post("/api/check", content=body).status_code == status


def test_no_other_file_can_be_read(client, tmp_path):
    (tmp_path / "room.toml").write_text("[world]\n", encoding="utf-8")
    for name in ("room.toml", "nosuch.toml", "..%2Fsecret.toml"):
        assert client.get(f"/api/missions/{name}").status_code == 404
