"""Free texts of requests: one validation for all of them, so that none is kept with what a terminal would obey."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from labctl.answers.base import Request
from labctl.answers.benches import ClearRequest
from labctl.answers.campaigns import CampaignRequest, ReasonRequest
from labctl.answers.certificates import CertificateOrder, CertificateRequest, WithdrawRequest
from labctl.answers.certification import CertifyRequest, ReleaseRequest, RevokeRequest
from labctl.answers.standards import StandardCheckRequest
from labctl.answers.validity import CheckGyroRequest
from labctl.errors import BadRecording
from labctl.recording import read_recording, write_recording
from labctl.stop.latch import StopRequest
from labctl.texts import cleaned, control_character
from tests.helpers.simulated_recordings import single_axis

CLEAR = "\x1b[2Jwas dropped"
#: Escape, line end, next line of C1, and one that turns the direction of what follows.
BAD = ["a\x1b[31m", "a\nb", "a\x85b", "a\u202eb", "a\u2028b"]


@pytest.mark.parametrize("text", BAD)
@pytest.mark.parametrize(
    ("kind", "given", "name"),
    [
        (CertificateRequest, {"by": "Ada", "amend": "street"}, "amend"),
        (CertificateRequest, {"by": "Ada"}, "by"),
        (WithdrawRequest, {"number": "1", "by": "Ada", "reason": "street"}, "reason"),
        (CertifyRequest, {"by": "Ada", "reason": "good"}, "reason"),
        (RevokeRequest, {"by": "Ada", "reason": "good"}, "by"),
        (ReleaseRequest, {"by": "Ada", "reason": "good"}, "reason"),
        (ClearRequest, {"by": "Ada", "reason": "good"}, "reason"),
        (CheckGyroRequest, {"by": "Ada", "reason": "good"}, "reason"),
        (CampaignRequest, {"recipe": "short", "hide": ["bias"]}, "hide"),
        (CampaignRequest, {"recipe": "short", "confirmed_by": "Ada"}, "confirmed_by"),
        (CertificateOrder, {"item": {"manufacturer": "KVH"}}, "item.manufacturer"),
        (CertificateOrder, {"customer": {"name": "Works"}}, "customer.name"),
    ],
)  # fmt: skip
def test_a_control_character_is_refused_where_it_stands(
    kind: type[Request], given: dict[str, Any], name: str, text: str
) -> None:
    first, _, inner = name.partition(".")
    value: Any = {inner: text} if inner else [text] if isinstance(given.get(first), list) else text
    kind.model_validate(given)
    with pytest.raises(ValidationError) as refused:
        kind.model_validate({**given, first: value})
    assert refused.value.errors()[0]["loc"][0] == first
    if kind is not CertificateOrder:
        assert "control character (U+" in refused.value.errors()[0]["msg"]


def test_a_text_of_several_lines_keeps_its_lines_and_no_other_control_character() -> None:
    order = CertificateOrder.model_validate({"item": {"condition": "no damage\n\tlabel is missing"}})
    assert order.item.condition == "no damage\n\tlabel is missing"
    assert CampaignRequest(recipe='format = "labctl-recipe/1"\n').recipe.endswith("\n")
    with pytest.raises(ValidationError, match=r"it has a control character \(U\+001B at character 1\); write it"):
        StandardCheckRequest.model_validate({"value": 1.0, "u": 0.1, "note": CLEAR, "by": "Ada"})


def test_no_stop_and_no_abort_is_refused_for_its_words() -> None:
    assert ReasonRequest(reason=CLEAR, by="A\nda").text == " [2Jwas dropped (A da)"
    stop = StopRequest.new("A\x1bda", "key", CLEAR)
    assert (stop.by, stop.reason) == ("A da", " [2Jwas dropped")


def test_the_texts_of_a_recording_are_examined_at_its_import(tmp_path: Path) -> None:
    recording = single_axis(1)
    info = recording.info.model_copy(update={"notes": "two\nlines", "model": CLEAR})
    write_recording(replace(recording, info=info), tmp_path / "out")
    with pytest.raises(BadRecording, match=r"model has a control character \(U\+001B at character 1\); write it"):
        read_recording(tmp_path / "out")


def test_ordinary_texts_of_any_language_pass() -> None:
    for text in ("Größe 5 µm, ±3 °C", "校准", "a\u00a0b", "🙂", "שלום"):
        assert control_character(text) == ""
        assert cleaned(text) == text
