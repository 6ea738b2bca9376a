"""No secret reaches a record, by whatever way it comes: a field, a text, a traceback, the environment."""

from __future__ import annotations

import json
import secrets
from typing import Any

import pytest

from labctl.log.redaction import LONGEST, LONGEST_TRACEBACK, REMOVED, Redaction, secrets_of
from labctl.log.rendering import Rendering
from labctl.services.admin.api_keys import PREFIX, RANDOM_BYTES

KEY = PREFIX + secrets.token_urlsafe(RANDOM_BYTES)
PASSWORD = "gE:h@im/1"  # with what separates the parts of an address
RECORDS: list[dict[str, Any]] = [
    {"authorization": f"Bearer {KEY}"},
    {"Authorization": KEY},
    {"headers": {"authorization": f"Bearer {KEY}", "cookie": KEY}},
    {"headers": [(b"authorization", f"Bearer {KEY}".encode())]},
    {"detail": f"the header was authorization: bearer {KEY}"},
    {"detail": f"key {KEY} is not known"},
    {"detail": f"Authorization: Basic {PASSWORD}"},
    {"path": f"/api/units?key={KEY}"},
    {"api_key": "short", "api-key": "short"},
    {"password": PASSWORD, "db_password": PASSWORD},
    {"database": f"postgresql+psycopg://lab:{PASSWORD}@db.example/lab"},
    {"reason": f"(connection to postgresql://lab:{PASSWORD}@db.example:5432/lab failed)"},
    {"reason": f"host=db user=lab password={PASSWORD} dbname=lab"},
    {"reason": f"postgresql://db.example/lab?user=lab&password={PASSWORD}"},
    {"environment": {"LABCTL_KEY": KEY, "PGPASSWORD": PASSWORD}},
    {"call": f"run(LABCTL_KEY={KEY!r}, token='{KEY}')"},
    {"nested": [{"deep": [{"secret": KEY}]}]},
    {"event": f"started with {KEY}"},
    {"reason": "x" * (LONGEST - 20) + f" {KEY}"},
]


@pytest.mark.parametrize("fields", RECORDS, ids=lambda fields: next(iter(fields)))
@pytest.mark.parametrize("for_a_person", [True, False])
def test_no_secret_is_in_a_line(fields: dict[str, Any], for_a_person: bool) -> None:
    line = Rendering("test", Redaction(), for_a_person=for_a_person)(None, "info", {"event": "e", **fields})
    for secret in (KEY, KEY[-30:], PASSWORD):
        assert secret not in line


def test_a_traceback_has_no_secret_either() -> None:
    try:
        raise RuntimeError(f"cannot connect to postgresql://lab:{PASSWORD}@db/lab with {KEY}")
    except RuntimeError as error:
        line = Rendering("test", Redaction(), for_a_person=False)(None, "error", {"event": "e", "exc_info": error})
    assert "Traceback" in json.loads(line)["exception"]
    assert PASSWORD not in line
    assert KEY not in line


def test_what_this_process_was_given_is_removed_in_any_form() -> None:
    """A password that stands alone is known by nothing but its value."""
    environment = {"LABCTL_KEY": "an-own-form", "LABCTL_DATABASE": "postgresql://u:p%40ss-word@db/lab"}
    redaction = Redaction(secrets_of(environment, ["postgresql://u:geheim@db/lab"]))
    text = redaction.text("an-own-form, then p%40ss-word, then p@ss-word, then geheim")
    assert text == ", then ".join([REMOVED] * 4)


def test_a_path_is_no_address_and_a_short_password_is_no_word() -> None:
    assert secrets_of({}, ["/var/lib/labctl/lab.sqlite", "postgresql://u:abc@db/lab", "http://[broken"]) == frozenset()


@pytest.mark.parametrize(
    "text",
    [
        "campaign 3 on bench single-axis-sim: chamber to 25 deg C",
        "labctl_campaigns_failed",
        "http://127.0.0.1:8420",
        "the key of the cabinet, the token ring, a basic unit",
        "/dev/serial/by-id/usb-FTDI:port@1",
    ],
)
def test_text_without_a_secret_is_unchanged(text: str) -> None:
    assert Redaction().text(text) == text


def test_a_record_has_an_end() -> None:
    redaction = Redaction()
    assert len(redaction.text("x" * 10**6)) < LONGEST + 50
    cut = redaction.traceback("Traceback\n" + "x" * 10**6 + "\nthe error itself")
    assert len(cut) < LONGEST_TRACEBACK + 10
    assert cut.endswith("the error itself")
    deep: Any = "end"
    for _ in range(100):
        deep = {"down": deep, "many": list(range(1000))}
    assert len(json.dumps(redaction.fields({"deep": deep}))) < 20_000


def test_nothing_that_a_terminal_obeys_is_shown_to_a_person() -> None:
    shown = Rendering("test", Redaction(), for_a_person=True)
    line = shown(None, "info", {"event": "e\x1b[2J", "reason": "a\x1b]0;title\x07b\r\x9b2J\u202e", "unit": "A\nB"})
    assert not {"\x1b", "\x07", "\r", "\n", "\x9b", "\u202e"} & set(line)
    assert r"a\x1b]0;title\x07b" in line
