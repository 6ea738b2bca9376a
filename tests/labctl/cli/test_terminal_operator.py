"""The operator at the terminal that runs a campaign: what counts as an answer, and that it is recorded."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from labctl.acting_user import Actor, acting
from labctl.answers.campaigns import ResumeRequest, StartRequest
from labctl.errors import Stopped
from labctl.services.campaigns import preparation, resume
from labctl.services.campaigns.execution import run_here
from labctl.services.campaigns.resume import resume_here
from labctl.store import open_store
from procedures.contracts.operator import HumanOperator, Prompt


@pytest.mark.slow
def test_answers_and_resumes_at_a_terminal_are_in_the_audit_trail(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    location = str(tmp_path / "lab.sqlite")
    for module in (preparation, resume):
        monkeypatch.setattr(module, "operator_of", lambda _: HumanOperator())
    seen: list[int] = []

    def attend(operator: Any, note: Callable[[str], None]) -> None:
        """Do what is asked as soon as it is asked."""
        put = operator.ask

        def ask(prompt: Prompt) -> None:
            put(prompt)
            operator.confirm(prompt.id, "Ada")
            note(f"{prompt.id}: done")

        operator.ask = ask

    def tired(answer: Any) -> None:
        if answer.step == 7 and not seen:
            seen.append(answer.step)
            raise KeyboardInterrupt

    with acting(Actor("ada", "command line")):
        with pytest.raises(Stopped):
            run_here(location, StartRequest(recipe="short"), tired, attend)
        resume_here(location, 1, None, None, ResumeRequest(by="Ada"), None, attend)
    with open_store(location, write=False) as store:
        rows = store.audit.rows()
        assert store.campaigns.get(1).state == "done"
    assert any(row.action == "campaign confirm" for row in rows)
    resumed = [row for row in rows if row.action == "campaign resume"]
    assert [(row.who, "resumed by Ada" in row.detail["reason"]) for row in resumed] == [("ada", True)]
