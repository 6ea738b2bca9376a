"""A service that simulates another date: its campaigns, drafts and certifications are of that date."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.helpers.certifying import OVERRIDE
from tests.helpers.drafted_recipe import DRAFTED
from tests.helpers.lab import Lab
from tests.helpers.processes import running

DAY = "2031-11-23"
UNIT = "FOG-0001"


def test_campaign_draft_and_certification_have_the_date_of_the_service(tmp_path: Path) -> None:
    with running(tmp_path / "lab.sqlite", "--speed", "0", "--simulated-start", f"{DAY}T08:00Z") as service:
        entered = service.run("campaign", "start", "short", "--at", "2031-11-23T07:00Z", status=2)
        assert "it is now 2031-11-23" in entered.stderr
        service.http.post("/api/campaigns", json={"recipe": DRAFTED}).raise_for_status()
        found = service.until_ended(1)
        assert found["started_at"][:10] == DAY
        while found["drafts"][0]["state"] != "made":  # the test has a time-out
            found = service.http.get("/api/campaigns/1").json()
        assert found["drafts"][0]["at"][:10] == DAY
        certify = f"/api/units/{UNIT}/calibrations/1/certify"
        act = service.http.post(certify, json={"by": "A. Person", "due_days": 365, **OVERRIDE}).json()
        assert (act["at"][:10], act["due"][:10]) == (DAY, "2032-11-22")
        assert service.http.get("/api/units?due_within=400d").json()[0]["serial"] == UNIT
        refused = service.run("campaign", "start", "short", "--simulated-start", DAY, status=2)
        assert "--simulated-start" in refused.stderr
        assert "at its own speed and date" in refused.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (["--simulated-start", "someday"], "--simulated-start 'someday' cannot be read; write 2027-11-23T08:00Z"),
        (["--simulated-start", DAY], "this service has no simulated bench; give --simulate, or leave the option out"),
        (
            ["--simulated-start", DAY, "--bench", "example-real"],
            "has instruments outside this process, which have the time of this computer; leave the option out",
        ),
    ],
)
def test_a_date_that_a_service_cannot_have_is_refused(tmp_path: Path, options: list[str], reason: str) -> None:
    said = Lab(tmp_path).run("serve", "--port", "0", *options, status=2).stderr
    assert reason in " ".join(said.split())
