"""The files of the pages: what a browser keeps for good, what it asks again, and in which coding they travel."""

from __future__ import annotations

import gzip
import os
import re
from pathlib import Path

import pytest
from backports import zstd
from fastapi import FastAPI
from starlette.testclient import TestClient

from labctl.web import install
from labctl.web.assets import Assets, accepted_codings
from labctl.web.pages import FOLDER, PLOTLY, PLOTLY_CARTESIAN

FIGURES = FOLDER / "js" / "core" / "figure.js"


@pytest.fixture
def client() -> TestClient:
    app = FastAPI()
    install(app)
    return TestClient(app)


def release_of(client: TestClient) -> str:
    """Return the prefix of the addresses that the document of the pages names."""
    named = set(re.findall(r'(?:src|href)="(/static/[0-9a-f]{12}/)', client.get("/").text))
    assert len(named) == 1
    return named.pop()


def test_each_file_of_a_page_has_an_address_of_its_release(client: TestClient) -> None:
    document = client.get("/").text
    named = re.findall(r'(?:src|href)="([^"]+)"', document)
    assert named
    for address in named:
        answer = client.get(address)
        assert answer.status_code == 200, address
        assert answer.headers["cache-control"] == "public, max-age=31536000, immutable"


def test_both_builds_of_plotly_are_of_one_version(client: TestClient) -> None:
    """Else a figure would change with what else its page shows; `npm pack plotly.js-cartesian-dist-min@VERSION`."""
    heads = [path.read_text(encoding="utf-8")[:200] for path in (PLOTLY, PLOTLY_CARTESIAN)]
    first, second = (re.search(r"plotly\.js .*v(\d+\.\d+\.\d+)", head) for head in heads)
    assert first is not None
    assert second is not None
    assert first[1] == second[1]
    served = client.get(release_of(client) + "plotly-cartesian.js")
    assert served.content == b"//# allFunctionsCalledOnLoad\n" + PLOTLY_CARTESIAN.read_bytes()
    assert len(served.content) < PLOTLY.stat().st_size / 3
    assert PLOTLY_CARTESIAN.with_name("plotly.LICENSE").read_text(encoding="utf-8").startswith("MIT License")


def test_no_file_names_another_by_an_address_that_does_not_change() -> None:
    fixed = re.compile(r"""["'(]/static/""")
    named = [
        f"{path.relative_to(FOLDER)}: {line.strip()}"
        for path in sorted(FOLDER.rglob("*.*s"))
        for line in path.read_text(encoding="utf-8").splitlines()
        if fixed.search(line)
    ]
    assert named == []


def test_the_document_of_a_page_is_asked_for_again_and_answered_without_a_body_while_unchanged(
    client: TestClient,
) -> None:
    first = client.get("/units/A1")
    assert first.headers["cache-control"] == "no-cache"
    again = client.get("/units/A1", headers={"if-none-match": first.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    other = client.get("/units/A1", headers={"if-none-match": '"of before"'})
    assert other.status_code == 200


@pytest.mark.parametrize(
    ("asked", "coding", "unpack"),
    [
        ("gzip, deflate, br, zstd", "zstd", zstd.decompress),
        ("gzip, deflate", "gzip", gzip.decompress),
        ("zstd;q=0, gzip;q=0.5", "gzip", gzip.decompress),
        ("br", None, bytes),
        ("identity", None, bytes),
    ],
)
def test_a_file_travels_in_the_best_coding_that_the_browser_takes(
    client: TestClient, asked: str, coding: str | None, unpack: object
) -> None:
    with client.stream("GET", release_of(client) + "plotly.js", headers={"accept-encoding": asked}) as answer:
        raw = b"".join(answer.iter_raw())
    assert answer.headers.get("content-encoding") == coding
    assert answer.headers["vary"] == "Accept-Encoding"
    assert int(answer.headers["content-length"]) == len(raw)
    assert callable(unpack)
    assert unpack(raw) == PLOTLY.read_bytes()


def test_codings_have_validators_of_their_own(client: TestClient) -> None:
    address = release_of(client) + "js/core/figure.js"
    tags = {client.get(address, headers={"accept-encoding": coding}).headers["etag"] for coding in ("zstd", "gzip", "")}
    assert len(tags) == 3


def test_a_head_request_has_the_headers_of_the_file_and_no_body(client: TestClient) -> None:
    for address in ("/", "/units/A1", release_of(client) + "js/main.js"):
        head, whole = client.head(address), client.get(address)
        assert head.status_code == 200
        assert head.content == b""
        assert head.headers["etag"] == whole.headers["etag"]
        assert head.headers["content-length"] == whole.headers["content-length"]


def test_a_page_of_an_older_release_gets_the_files_of_now_and_keeps_none_of_them(client: TestClient) -> None:
    answer = client.get("/static/0123456789ab/js/core/figure.js")
    assert answer.content == FIGURES.read_bytes()
    assert answer.headers["cache-control"] == "no-cache"


@pytest.mark.parametrize("address", ["js/nosuch.js", "../pages.py", "..%2f..%2fpages.py", "%2e%2e/pages.py", "js", ""])
def test_nothing_but_the_files_of_the_pages_is_served(client: TestClient, address: str) -> None:
    assert client.get("/static/" + address).status_code == 404


def test_a_changed_file_changes_the_release_and_is_read_again(tmp_path: Path) -> None:
    script = tmp_path / "main.js"
    script.write_text("let a = 1;")
    assets = Assets(tmp_path, {})
    before = assets.release()
    first = assets.get("main.js", ())
    assert first is not None
    assert assets.split(f"{before}/main.js") == ("main.js", True)
    script.write_text("let a = 2;")
    os.utime(script, ns=(1, 1))  # a copy may carry any time
    after = assets.release()
    assert after != before
    assert assets.split(f"{before}/main.js") == ("main.js", False)
    second = assets.get("main.js", ())
    assert second is not None
    assert (first.body, second.body) == (b"let a = 1;", b"let a = 2;")


def test_files_of_one_size_and_time_differ_by_their_content(tmp_path: Path) -> None:
    releases = set()
    for content in ("let a = 1;", "let a = 2;"):
        (tmp_path / "main.js").write_text(content)
        os.utime(tmp_path / "main.js", ns=(1, 1))  # as an installer may leave all files
        releases.add(Assets(tmp_path, {}).release())
    assert len(releases) == 2


def test_codings_that_a_client_refuses_are_not_accepted() -> None:
    assert accepted_codings("gzip;q=0, zstd ; q=0.0 , br;q=0.3") == {"br"}
