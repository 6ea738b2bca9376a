"""Access: keys and roles on every path of the API, and no foreign request over loopback."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from instruments.clock import SystemClock
from labctl import web
from labctl.answers.admin import KeyRequest, Role
from labctl.api import create_app
from labctl.api.access_policy import ASKING, AccessPolicy
from labctl.errors import BadInput, Conflict, NotFound
from labctl.processes.settings import LOOPBACK_NAMES
from labctl.services.admin.api_keys import create_key, digest_of, require_an_api_key, revoke_key
from labctl.services.lab_service import LabService
from labctl.store import Store, open_store
from labctl.store.connection.database import Database
from tests.helpers.openapi import operations

CLOCK = SystemClock()
OPEN = {("get", "/health"), ("get", "/health/heartbeat")}
#: What the head of each page shows, which is open too: nothing of units, benches or people.
OF_HEARTBEAT = {"heard_s", "not_stopped", "read_only", "acts_at", "replica"}


def needs(method: str, path: str) -> Role:
    """What an operation asks for, as the access policy states it."""
    if path.startswith("/api/keys") or path.endswith(("/certify", "/calibrations/{version}/revoke", "/release")):
        return Role.APPROVER
    withdraws = ("/certificates/withdraw", "/findings/{finding}/withdraw")
    if method == "post" and path.endswith(("/calibrations/{version}/certificate", *withdraws)):
        return Role.APPROVER
    return Role.VIEWER if method == "get" or path in ASKING else Role.OPERATOR


def address(path: str) -> str:
    return re.sub(r"\{[^}]*\}", "1", path)


class Guarded:
    """An application that asks for keys, and one key of each kind."""

    def __init__(self, store: Store, client: TestClient) -> None:
        self.store = store
        self.client = client
        self.keys = {role: create_key(store, KeyRequest(name=role.value, role=role), CLOCK.utc()).key for role in Role}
        revoked = create_key(store, KeyRequest(name="revoked", role=Role.APPROVER), CLOCK.utc())
        revoke_key(store, "revoked", "lost", CLOCK.utc())
        good = self.keys[Role.APPROVER]
        self.refused: dict[str, str | None] = {
            "missing": None,
            "revoked": f"Bearer {revoked.key}",
            "wrong": "Bearer labctl_" + "x" * 43,
            "interrupted": f"Bearer {good[:-1]}",
            "another scheme": f"Basic {good}",
            "no scheme": good,
            "empty": "Bearer ",
            "the digest": f"Bearer {digest_of(good)}",
            "not ASCII": "Bearer \xe9\xff",
        }

    def ask(self, method: str, path: str, authorization: str | None) -> Any:
        headers = {} if authorization is None else {"Authorization": authorization.encode("latin-1")}
        return self.client.request(method, path, headers=headers, json={} if method == "post" else None)


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Guarded]:
    store = Store(Database(str(tmp_path_factory.mktemp("guarded") / "lab.sqlite"), write=True))
    with TestClient(create_app(LabService(store, CLOCK), AccessPolicy(keys=True))) as client:
        yield Guarded(store, client)


def test_there_are_paths_to_ask() -> None:
    assert len(operations()) > 20
    assert set(operations()) >= OPEN


@pytest.mark.parametrize(("method", "path"), operations())
def test_wrong_missing_and_revoked_keys_are_refused_on_every_path(guarded: Guarded, method: str, path: str) -> None:
    for kind, authorization in guarded.refused.items():
        answer = guarded.ask(method, address(path), authorization)
        if (method, path) in OPEN:
            assert answer.json().keys() - OF_HEARTBEAT == {"status", "version"}, kind
            continue
        assert answer.status_code == 401, kind
        assert answer.headers["www-authenticate"].startswith("Bearer"), kind
        assert answer.headers["content-type"] == "application/problem+json", kind
        assert answer.json()["type"] == "urn:labctl:problem:not-identified", kind


@pytest.mark.slow
@pytest.mark.parametrize(("method", "path"), operations())
def test_every_path_asks_for_its_role_and_no_more(guarded: Guarded, method: str, path: str) -> None:
    for role, key in guarded.keys.items():
        answer = guarded.ask(method, address(path), f"Bearer {key}")
        assert answer.status_code != 401
        allowed = role.may(needs(method, path))
        assert (answer.status_code != 403) == allowed, role
        if not allowed:
            assert answer.json()["type"] == "urn:labctl:problem:not-allowed"
            assert (
                f"key {role.value} has the role {role.value}, but this request needs the role"
                in answer.json()["detail"]
            )


@pytest.mark.parametrize("path", ["/", "/units/FOG-0001", "/static/js/main.js"])
def test_pages_are_open_and_hold_nothing_of_the_house(guarded: Guarded, path: str) -> None:
    answer = guarded.ask("get", path, None)
    assert answer.status_code == 200
    folder = Path(web.__file__).parent / "static"
    sent = re.sub(rb"/static/[0-9a-f]{12}/", b"/static/", answer.content)  # the release is in the addresses of files
    # the document also names the script of the page and that of figures, which are the same for every unit
    own = re.sub(rb'  <script( type="module"| async data-plotly) src="/static/[a-z/._-]+"></script>\n', b"", sent)
    plain = re.sub(
        rb'  <script type="module" src="/static/[a-z/._-]+"></script>\n', b"", (folder / "index.html").read_bytes()
    )
    assert own == plain or sent == (folder / "js" / "main.js").read_bytes()
    other = guarded.ask("get", path.replace("FOG-0001", "ANOTHER-1"), None)
    assert other.content == answer.content


@pytest.mark.parametrize(
    "path", ["/api-docs", "/openapi.json", "/api/nowhere", "/health/", "/health/x", "/staticly", "/units-of-mine"]
)
def test_nothing_else_is_open(guarded: Guarded, path: str) -> None:
    assert guarded.ask("get", path, None).status_code == 401
    assert guarded.ask("post", path, None).status_code == 401


def test_odd_spellings_of_a_version_do_not_get_an_operator_past_the_approver(guarded: Guarded) -> None:
    body = {"by": "A", "reason": "B"}
    key = guarded.keys[Role.OPERATOR]
    for version in ("1", "+1", "%201", "01", "1.0", "1%20"):
        for path in (f"/api/units/X/calibrations/{version}/certify", f"/api/units/X/calibrations/{version}/certify/"):
            answer = guarded.client.post(path, json=body, headers={"Authorization": f"Bearer {key}"})
            assert answer.status_code == 403, path


def test_a_key_is_shown_once_and_kept_as_a_digest(guarded: Guarded, tmp_path: Path) -> None:
    location = str(tmp_path / "keys.sqlite")
    with open_store(location, write=True) as store:
        made = create_key(store, KeyRequest(name="robot", role=Role.VIEWER), CLOCK.utc())
        other = create_key(store, KeyRequest(name="other", role=Role.VIEWER), CLOCK.utc())
        assert made.key != other.key
        with pytest.raises(Conflict, match="a name is used only once"):
            create_key(store, KeyRequest(name="robot", role=Role.APPROVER), CLOCK.utc())
        with pytest.raises(NotFound, match="there is no key 'nobody'"):
            revoke_key(store, "nobody", "x", CLOCK.utc())
        revoke_key(store, "robot", "x", CLOCK.utc())
        with pytest.raises(Conflict, match="already revoked"):
            revoke_key(store, "robot", "x", CLOCK.utc())
    everything = b"".join(path.read_bytes() for path in tmp_path.iterdir())
    assert made.key.encode() not in everything
    assert digest_of(made.key).encode() in everything


def test_keys_over_http_and_in_the_audit_trail(guarded: Guarded) -> None:
    approver = {"Authorization": f"Bearer {guarded.keys[Role.APPROVER]}"}
    made = guarded.client.post("/api/keys", json={"name": "new", "role": "viewer"}, headers=approver).json()
    own = {"Authorization": f"bearer  {made['key']}"}
    assert guarded.client.get("/api/units", headers=own).status_code == 200
    assert "key" not in guarded.client.get("/api/keys", headers=approver).json()[0]
    gone = guarded.client.post("/api/keys/new/revoke", json={"reason": "moved on"}, headers=approver)
    assert gone.json()["revoked_at"] is not None
    assert guarded.client.get("/api/units", headers=own).status_code == 401
    rows = [row for row in guarded.client.get("/api/audit", headers=approver).json() if row["subject"] == "key new"]
    assert [(row["who"], row["action"]) for row in rows] == [("approver", "key create"), ("approver", "key revoke")]
    assert rows[1]["detail"] == {"role": "viewer", "reason": "moved on", "via": "key"}
    for name in ("../x", "", "a/b", "a\x00b", "x" * 101):
        refused = guarded.client.post("/api/keys", json={"name": name, "role": "viewer"}, headers=approver)
        assert refused.status_code == 422, name


def test_any_other_address_needs_a_key_first(tmp_path: Path) -> None:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        with pytest.raises(BadInput, match=r"--host 0\.0\.0\.0, .* labctl key create"):
            require_an_api_key(store, "--host 0.0.0.0")
        create_key(store, KeyRequest(name="only", role=Role.VIEWER), CLOCK.utc())
        require_an_api_key(store, "--host 0.0.0.0")
        revoke_key(store, "only", "x", CLOCK.utc())
        with pytest.raises(BadInput, match="no API key"):
            require_an_api_key(store, "--host 0.0.0.0")


Ask = Callable[..., Any]


@pytest.fixture
def loopback(tmp_path: Path) -> Iterator[Ask]:
    store = Store(Database(str(tmp_path / "lab.sqlite"), write=True))
    access = AccessPolicy(hosts=LOOPBACK_NAMES)
    with TestClient(create_app(LabService(store, CLOCK), access), base_url="http://127.0.0.1:8420") as client:

        def ask(method: str = "get", path: str = "/api/units", json: Any = None, **headers: str) -> Any:
            named = {name.replace("_", "-"): value for name, value in headers.items()}
            return client.request(method, path, headers=named, json=json)

        yield ask


NOTE = {"file": "x.sqlite", "bytes": 1, "sha256": "0" * 64}


@pytest.mark.parametrize("host", ["127.0.0.1:8420", "localhost", "LOCALHOST:1", "[::1]:8420"])
def test_this_machine_needs_no_key(loopback: Ask, host: str) -> None:
    assert loopback(host=host).status_code == 200
    assert loopback("post", "/api/backups", NOTE, host=host, origin=f"http://{host}").status_code == 204


@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1.evil.example", "localhost.evil.example:8420", "10.0.0.1", ""]
)
def test_a_name_that_was_bent_to_this_machine_is_refused(loopback: Ask, host: str) -> None:
    answer = loopback(host=host)
    assert answer.status_code == 403
    assert "is not accepted; use one of these addresses" in answer.json()["detail"]


@pytest.mark.parametrize(
    "headers",
    [
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"origin": "http://127.0.0.1:9999"},
        {"origin": "http://localhost:8420"},
        {"sec_fetch_site": "cross-site"},
        {"sec_fetch_site": "same-site"},
    ],
)
def test_a_page_of_another_site_may_not_act(loopback: Ask, headers: dict[str, str]) -> None:
    assert loopback("post", "/api/backups", NOTE, **headers).status_code == 403
    assert loopback("get", "/api/audit").json() == []
    asked = loopback("get", "/api/units", **headers).status_code
    assert asked == (403 if "sec_fetch_site" in headers else 200)


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_a_page_of_another_site_keeps_nothing_busy(loopback: Ask, site: str) -> None:
    """The browser keeps the answer from the page, but what computes it would be busy nevertheless."""
    paths = [
        "/api/units",
        "/api/units/U/calibrations/1/criticism",
        "/api/campaigns/1/events",
        "/api/recordings/1/allan",
    ]
    for method in ("get", "head", "options"):
        for path in paths:
            assert loopback(method, path, sec_fetch_site=site).status_code == 403, (method, path)
    assert loopback("get", "/health", sec_fetch_site=site).status_code == 200
    assert loopback("get", "/", sec_fetch_site=site).status_code == 200  # a link on another page
    for own in ("same-origin", "none"):
        assert loopback("get", "/api/units", sec_fetch_site=own).status_code == 200


@pytest.mark.parametrize("header", ["x_forwarded_for", "forwarded"])
def test_what_a_proxy_sends_on_needs_a_key(loopback: Ask, header: str) -> None:
    assert loopback(**{header: "for=10.1.2.3"}).status_code == 403


def test_who_acts_on_loopback(loopback: Ask) -> None:
    loopback("post", "/api/backups", NOTE)
    loopback("post", "/api/backups", NOTE, labctl_user="A.%20Person")
    loopback("post", "/api/backups", NOTE, labctl_user="x%00y")
    rows = loopback("get", "/api/audit").json()
    assert [row["who"] for row in rows] == ["local", "A. Person", "local"]
    assert {row["detail"]["via"] for row in rows} == {"loopback"}
    made = loopback("post", "/api/keys", {"name": "robot", "role": "viewer"}).json()
    refused = loopback("post", "/api/backups", NOTE, authorization=f"Bearer {made['key']}")
    assert refused.status_code == 403  # who shows a key has its role, here too
    assert loopback(authorization="Bearer wrong").status_code == 401


def test_calibrations_can_be_asked_for_by_head(loopback: Ask) -> None:
    for path in ("calibration", "calibrations", "ladder"):
        answer = loopback("head", f"/api/units/NO_SERVICE/{path}")
        assert answer.status_code in {400, 404}, path
