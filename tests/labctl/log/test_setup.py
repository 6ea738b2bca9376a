"""The log of a process: one line per record, of labctl or another library, after any failure."""

from __future__ import annotations

import asyncio
import json
import logging
import os
import subprocess
import sys
import threading
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from instruments.clock import VirtualClock
from labctl.config import LOG_LEVEL_VARIABLE
from labctl.errors import BadInput
from labctl.log import get_logger
from labctl.log.context import for_campaign, for_request
from labctl.log.repetition import MAX_FOREIGN, WINDOW_S, RepetitionLimit
from labctl.log.settings import LEVELS, is_read_by_a_person, level_asked
from labctl.log.setup import held_back, running_log
from tests.helpers.log_records import logged
from tests.helpers.patience import WAIT_S

log = get_logger()


def test_a_record_is_one_line_of_json_with_its_fields(tmp_path: Path) -> None:
    with logged(tmp_path) as records, for_campaign(3, "bench"), for_request("r-1"):
        log.info("step.ended", step=2, took_s=1.5, reason="a\nb")
    (found,) = records.all()
    assert {name: found[name] for name in ("level", "event", "process", "campaign", "bench", "request_id", "step")} == {
        "level": "info", "event": "step.ended", "process": "test", "campaign": 3, "bench": "bench",
        "request_id": "r-1", "step": 2,
    }  # fmt: skip
    assert found["timestamp"].endswith("Z")
    assert (found["pid"], found["took_s"], found["reason"]) == (os.getpid(), 1.5, "a\nb")


def test_nothing_is_written_before_a_log_begins_and_after_it_ends(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    log.error("before")
    with logged(tmp_path) as records:
        log.error("within")
    log.error("after")
    assert records.events() == ["within"]
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("level", LEVELS)
def test_a_level_leaves_out_what_is_below_it(tmp_path: Path, level: str) -> None:
    with logged(tmp_path, LEVELS[level]) as records:
        for name in LEVELS:
            getattr(log, name)(name)
    assert records.events() == list(LEVELS)[list(LEVELS).index(level) :]


def test_the_level_is_the_environments(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(LOG_LEVEL_VARIABLE, " Warning ")
    assert level_asked() == logging.WARNING
    monkeypatch.setenv(LOG_LEVEL_VARIABLE, "")
    assert level_asked() is None
    monkeypatch.setenv(LOG_LEVEL_VARIABLE, "loud")
    with pytest.raises(BadInput, match="LABCTL_LOG_LEVEL=loud is not a log level; set it to one of debug, info"):
        level_asked()


@pytest.mark.parametrize("variable", ["JOURNAL_STREAM", "INVOCATION_ID"])
def test_a_terminal_gets_words_and_a_service_manager_json(monkeypatch: pytest.MonkeyPatch, variable: str) -> None:
    monkeypatch.setenv(LOG_LEVEL_VARIABLE, "info")
    main, terminal = os.openpty()
    try:
        for name in ("JOURNAL_STREAM", "INVOCATION_ID"):
            monkeypatch.delenv(name, raising=False)
        assert is_read_by_a_person(terminal)
        with running_log("test", logging.INFO, descriptor=terminal):
            log.info("step.ended", outcome="done")
        shown = os.read(main, 4096).decode()
        assert "step.ended" in shown
        assert "{" not in shown
        monkeypatch.setenv(variable, "8:1")
        with running_log("test", logging.INFO, descriptor=terminal):
            log.info("step.ended", outcome="done")
        assert json.loads(os.read(main, 4096))["outcome"] == "done"
    finally:
        os.close(main)
        os.close(terminal)


def test_a_terminal_without_a_level_gets_one_sentence_for_each_change_of_state(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("JOURNAL_STREAM", "INVOCATION_ID", LOG_LEVEL_VARIABLE):
        monkeypatch.delenv(name, raising=False)
    main, terminal = os.openpty()
    at = {"campaign": 7, "bench": "triaxial-sim"}
    try:
        with running_log("test", logging.INFO, descriptor=terminal):
            log.info("request.ended", method="POST", path="/api/campaigns", status=201)
            log.info("campaign.state", **at, state="running", reason="started", t_s=0.0)
            log.info("step.ended", **at, step=1, steps=9, outcome="done")
            logging.getLogger("instruments.x").info("link.retry")
            log.error("step.ended", **at, step=2, steps=9, kind="acquire", outcome="failed", reason="no answer")
            log.info("bench.made_safe", bench="triaxial-sim", unconfirmed=[])
            log.warning("bench.made_safe", bench="triaxial-sim", unconfirmed=["table to rest"])
            log.warning("schedule.missed", start=3)
            log.info("campaign.state", **at, state="failed\x1b[2J", reason="no answer", t_s=9.0)
        lines = os.read(main, 4096).decode().splitlines()
    finally:
        os.close(main)
        os.close(terminal)
    assert [line[9:] for line in lines if "schedule.missed" not in line] == [
        "campaign 7 on triaxial-sim: running: started",
        "error: campaign 7 on triaxial-sim: step 2 of 9 (acquire) failed: no answer",
        "bench triaxial-sim is in its safe state",
        "warning: bench triaxial-sim is not confirmed safe: table to rest; inspect it",
        "campaign 7 on triaxial-sim: failed\\x1b[2J: no answer",
    ]
    assert [line for line in lines if "schedule.missed" in line]  # its fields, as no sentence fits them


def test_what_other_libraries_log_is_in_it_with_its_source(tmp_path: Path) -> None:
    with logged(tmp_path) as records, for_request("r-1"):
        logging.getLogger("uvicorn.error").warning("Invalid %s", "request")
        logging.getLogger("uvicorn.error").info("chatter")
        logging.getLogger("instruments.x").info("link.retry", extra={"device": "chamber"})
        with warnings.catch_warnings():
            warnings.simplefilter("always")
            warnings.warn("old", UserWarning, stacklevel=1)
    first, second, third = records.all()
    assert (first["event"], first["logger"], first["request_id"]) == ("Invalid request", "uvicorn.error", "r-1")
    assert (second["event"], second["device"]) == ("link.retry", "chamber")
    assert "UserWarning: old" in third["event"]


def test_a_flood_of_another_library_is_counted_not_written(tmp_path: Path) -> None:
    with logged(tmp_path) as records:
        for _ in range(5000):
            logging.getLogger("uvicorn.error").warning("Invalid HTTP request received.")
        logging.getLogger("uvicorn.error").error("another line of its code")
        assert held_back() == (0, 5000 - MAX_FOREIGN)
    found = records.all()
    assert [each["event"] for each in found].count("Invalid HTTP request received.") == MAX_FOREIGN
    assert found[-2]["event"] == "another line of its code"
    assert (found[-1]["event"], found[-1]["records"]) == ("log.held_back", 5000 - MAX_FOREIGN)
    assert found[-1]["source"].startswith("uvicorn.error, test_setup line ")


def test_a_bound_on_repetitions_begins_anew_after_its_time() -> None:
    clock = VirtualClock()
    limit = RepetitionLimit(2, clock=clock)
    assert [limit.admits("a") for _ in range(4)] == [True, True, False, False]
    assert limit.admits("b")
    assert (limit.take_count("a"), limit.take_count("a"), limit.take_count("c")) == (2, 0, 0)
    clock.sleep(WINDOW_S)
    assert limit.admits("a")


@pytest.mark.filterwarnings("default::pytest.PytestUnhandledThreadExceptionWarning")
def test_an_error_that_nobody_caught_in_a_thread_is_a_record(tmp_path: Path) -> None:
    def fail() -> None:
        raise ValueError("the thread's own")

    before = threading.excepthook
    with logged(tmp_path) as records:
        thread = threading.Thread(target=fail, name="campaign-7")
        thread.start()
        thread.join()
    assert threading.excepthook is before
    (found,) = records.all()
    assert (found["event"], found["level"], found["thread"]) == ("thread.failed", "error", "campaign-7")
    assert found["error_type"] == "ValueError"
    assert "the thread's own" in found["exception"]
    assert "in fail" in found["exception"]


def test_an_error_in_a_task_that_nobody_awaits_is_a_record(tmp_path: Path, in_a_loop: Callable[[Any], Any]) -> None:
    async def fail() -> None:
        raise ValueError("the task's own")

    async def main() -> None:
        task = asyncio.get_running_loop().create_task(fail())
        await asyncio.wait([task])
        del task

    with logged(tmp_path) as records:
        in_a_loop(main())
    (found,) = records.all()
    assert (found["logger"], found["level"]) == ("asyncio", "error")
    assert "the task's own" in found["exception"]


def test_an_error_in_a_finalizer_is_a_record(tmp_path: Path) -> None:
    class Half:
        def __del__(self) -> None:
            raise ValueError("half gone")

    with logged(tmp_path) as records:
        half = Half()
        del half
    (found,) = records.all()
    assert found["event"] == "error.ignored"
    assert "half gone" in found["exception"]


PROGRAM = """
import logging, sys, threading
from labctl.log import get_logger
from labctl.log.setup import begin_log
begin_log("test", logging.INFO)
get_logger().info("begun")
{}
"""


def run(program: str, **options: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", PROGRAM.format(program)], text=True, check=False, timeout=WAIT_S, **options
    )


def test_an_error_that_ends_a_process_is_its_last_record() -> None:
    done = run("raise ValueError('the end')", stderr=subprocess.PIPE)
    records = [json.loads(line) for line in done.stderr.splitlines()]
    assert [each["event"] for each in records] == ["begun", "process.failed"]
    assert (records[1]["level"], records[1]["error_type"], done.returncode) == ("critical", "ValueError", 1)
    assert "the end" in records[1]["exception"]


def test_a_process_without_standard_error_goes_on_and_writes_into_no_other_file(tmp_path: Path) -> None:
    """Its number 2 is the next file that is opened, whatever that is."""
    program = (
        "import logging\nfrom labctl.log import get_logger\nfrom labctl.log.setup import begin_log\n"
        f"file = open({str(tmp_path / 'data')!r}, 'w')\nassert file.fileno() == 2\n"
        "begin_log('test', logging.INFO)\nget_logger().error('a record')\nfile.write('data')\n"
    )
    done = subprocess.run(
        ["/bin/sh", "-c", 'exec 2>&-; exec "$0" -c "$1"', sys.executable, program],
        check=False, timeout=WAIT_S, stdout=subprocess.PIPE,
    )  # fmt: skip
    assert done.returncode == 0
    assert (tmp_path / "data").read_text(encoding="utf-8") == "data"


@pytest.mark.slow
@pytest.mark.parametrize("output", ["/dev/full", "broken pipe"])
def test_a_full_disk_or_a_broken_pipe_ends_nothing(output: str) -> None:
    if output == "broken pipe":
        reading, writing = os.pipe()
        os.close(reading)
    else:
        writing = os.open(output, os.O_WRONLY)
    try:
        done = run(
            "for _ in range(5000): get_logger().error('x' * 100)\nsys.stdout.write('went on')",
            stdout=subprocess.PIPE, stderr=writing,
        )  # fmt: skip
    finally:
        os.close(writing)
    assert (done.returncode, done.stdout) == (0, "went on")


@pytest.mark.slow
def test_an_output_that_takes_nothing_keeps_a_process_from_ending_only_for_a_moment() -> None:
    reading, writing = os.pipe()
    try:
        done = run(
            "for _ in range(5000): get_logger().error('x' * 1000)\nsys.stdout.write('went on')",
            stdout=subprocess.PIPE, stderr=writing,
        )  # fmt: skip
    finally:
        os.close(reading)
        os.close(writing)
    assert (done.returncode, done.stdout) == (0, "went on")


def test_a_record_that_cannot_be_rendered_stops_nobody(tmp_path: Path) -> None:
    class Wild:
        def __str__(self) -> str:
            raise ValueError("no text")

    with logged(tmp_path) as records:
        log.info("wild", value=Wild())
        log.info("next")
    assert records.events() == ["log.unreadable", "next"]
    assert records.all()[0]["error"] == "ValueError in a record of 'wild'"


def test_before_a_log_has_begun_a_record_loads_no_library_and_is_written_nowhere() -> None:
    program = (
        "import sys\n"
        "from labctl.log import get_logger\n"
        "log = get_logger(bench='left')\n"
        "log.error('too.early', value=1)\n"
        "assert 'structlog' not in sys.modules\n"
        "log.bind(value=2).error('bound.early')\n"
        "assert 'structlog' in sys.modules\n"
        "log.critical('still.early')\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
