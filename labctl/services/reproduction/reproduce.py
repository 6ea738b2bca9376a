"""The use case: a paper made again, as a page and as numbers, in a folder."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from pathlib import Path

from labctl.answers.reproduction import PaperNumber, PaperPage
from labctl.errors import BadInput
from labctl.papers import PAPERS, Paper, Printed
from labctl.plots import paper_html
from labctl.progress import report_stage
from labctl.services.reproduction import ojeda, weiss, yang
from labctl.services.reproduction.answer import (
    ContradictionResponse,
    FigureResponse,
    MissingResponse,
    NumberResponse,
    ReproductionResponse,
)
from labctl.services.reproduction.findings import Findings, points_in
from labctl.services.reproduction.sources import of_unit
from labctl.store import Store

OWN: dict[str, Callable[[], Findings]] = {
    "ojeda2000": ojeda.reproduce_own, "yang2018": yang.reproduce_own, "weiss1995": weiss.reproduce_own,
}  # fmt: skip
OF_UNIT = {"ojeda2000": ojeda.reproduce, "yang2018": yang.reproduce, "weiss1995": weiss.reproduce}
#: Every file that a reproduction writes; a folder with others is refused.
FILE_NAMES = frozenset(f"{name}.{suffix}" for name in PAPERS for suffix in ("html", "json"))


def paper_named(name: str) -> Paper:
    """Return a paper. Raises BadInput for an unknown name."""
    if name not in PAPERS:
        raise BadInput(f"paper {name!r} is not known; choose one of {', '.join(PAPERS)}")
    return PAPERS[name]


def check_folder(folder: Path) -> None:
    """Raise BadInput for a folder that holds anything else than reproductions, or a file in its place."""
    if folder.exists() and not folder.is_dir():
        raise BadInput(f"{folder}: this is a file, but a folder is needed; name a folder with --out")
    others = sorted(path.name for path in folder.iterdir() if path.name not in FILE_NAMES) if folder.is_dir() else []
    if others:
        raise BadInput(
            f"{folder}: the folder contains {others[0]!r}, which is not a file of an earlier reproduction; name "
            "a new folder with --out"
        )


def reproduce_own(name: str, folder: Path) -> ReproductionResponse:
    """Make a paper again from what comes with labctl. Raises BadInput."""
    paper = paper_named(name)
    check_folder(folder)
    return _written(paper, OWN[name](), folder, None, None)


def reproduce_unit(
    store: Store, name: str, serial: str, recording: int | None, axis: str | None, folder: Path
) -> ReproductionResponse:
    """Make a paper again from a unit's recording, default the newest. Raises BadInput, NotFound, NotEnoughData."""
    paper = paper_named(name)
    check_folder(folder)
    measured = of_unit(store, serial, recording)
    findings = OF_UNIT[name](measured, axis).told(measured.origin)
    return _written(paper, findings, folder, serial, measured.number)


def _rows(printed: Printed, findings: Findings) -> list[NumberResponse]:
    """Return a row for each source that a printed number was reproduced from; one without a number where none is."""

    def row(of: str, value: float | None, why: str, origin: str = "") -> NumberResponse:
        has_both = value is not None and printed.value is not None
        return NumberResponse(
            place=printed.place, quantity=printed.quantity, unit=printed.unit, relation=printed.relation,
            printed=printed.value, of=of, reproduced=value,
            difference=(value or 0.0) - (printed.value or 0.0) if has_both else None, why=why, origin=origin,
        )  # fmt: skip

    rows = [row(value.of, value.value, value.why, value.origin) for value in findings.values if value.id == printed.id]
    return rows or [row("", None, "not made; see what could not be made")]


def _answer(
    paper: Paper, findings: Findings, folder: Path, serial: str | None, recording: int | None
) -> ReproductionResponse:
    return ReproductionResponse(
        paper=paper.id, title=paper.title, citation=paper.citation, serial=serial, recording=recording,
        sources=findings.sources, story=findings.story,
        numbers=[row for printed in paper.printed for row in _rows(printed, findings)],
        contradictions=[
            ContradictionResponse(place=c.place, statement=c.statement, decision=c.decision)
            for c in paper.contradictions
        ],
        missing=[MissingResponse(what=m.what, why=m.why, record=m.record) for m in findings.missing],
        figures=[FigureResponse(id=f["id"], title=f["title"], points=points_in(f)) for f in findings.figures],
        folder=str(folder), files=[f"{paper.id}.html", f"{paper.id}.json"],
    )  # fmt: skip


def _page(answer: ReproductionResponse, findings: Findings) -> PaperPage:
    numbers: list[PaperNumber] = [
        {
            "place": n.place, "quantity": n.quantity, "unit": n.unit, "relation": n.relation, "printed": n.printed,
            "of": n.of, "reproduced": n.reproduced, "difference": n.difference, "why": n.why, "origin": n.origin,
        }
        for n in answer.numbers
    ]  # fmt: skip
    return {
        "title": answer.title, "citation": answer.citation, "sources": answer.sources, "story": answer.story,
        "numbers": numbers, "figures": findings.figures,
        "contradictions": [(c.place, c.statement, c.decision) for c in answer.contradictions],
        "missing": [(m.what, m.why, m.record) for m in answer.missing],
    }  # fmt: skip


def _written(
    paper: Paper, findings: Findings, folder: Path, serial: str | None, recording: int | None
) -> ReproductionResponse:
    """Write the page and the numbers; each file appears whole or not at all."""
    answer = _answer(paper, findings, folder, serial, recording)
    report_stage("write the page")
    content = {
        f"{paper.id}.html": paper_html(_page(answer, findings)),
        f"{paper.id}.json": json.dumps(answer.model_dump(mode="json"), indent=2, ensure_ascii=False) + "\n",
    }
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=f".{folder.name}-") as made:
        for name, text in content.items():
            (Path(made) / name).write_text(text, encoding="utf-8")
        folder.mkdir(exist_ok=True)
        for name in content:
            (Path(made) / name).replace(folder / name)
    return answer
