"""The bundles of a page: what the sources say, in few files; which of them the document of a page names."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient

from labctl.web import install
from labctl.web.bundles import ENTRY, Bundles
from labctl.web.pages import FOLDER

MODULES = sorted(path.relative_to(FOLDER / "js").as_posix() for path in (FOLDER / "js").rglob("*.js"))
#: Loaded before the page by itself: it is no module.
ALONE = "core/theme.js"
#: Three modules of each form that the sources use, and a module that is loaded later.
SOURCES = {
    "js/main.js": 'import { named } from "./core/a.js";\nimport {\n  all,\n  Kind as Sort,\n} from "./core/b.js";\n'
    'const later = await import("./pages/p.js");\nconsole.log(named(), all.join(), new Sort().size, later.page());\n',
    "js/core/a.js": "export function named() {\n  return count++;\n}\nlet count = 7;\n",
    "js/core/b.js": 'import { named } from "./a.js";\nexport const all = [named(), named()];\n'
    "export class Kind {\n  size = 3;\n}\nconst named_here = 1;\n",
    "js/pages/p.js": 'import { named } from "../core/a.js";\nimport { own } from "./q.js";\n'
    "export const page = () => `${own} ${named()} ${import.meta.url.endsWith('js/pages/p.js')}`;\n",
    "js/pages/q.js": "const count = 'q';\nexport const own = count;\n",
}


def of_sources() -> Bundles:
    return Bundles(lambda name: (FOLDER / name).read_text(encoding="utf-8"))


def test_every_module_can_be_bundled_and_loses_no_export() -> None:
    bundles = of_sources()
    for module in MODULES:
        if module == ALONE:
            continue
        bundle = bundles.content(f"bundles/{module}")
        assert not re.search(r"^(import \{|export )", bundle, re.MULTILINE), module
        if module != "main.js":
            whole = bundles.content("bundles/main.js") + bundle
            text = (FOLDER / "js" / module).read_text(encoding="utf-8")
            exported = re.findall(r"^export (?:async )?(?:function\*?|const|class) (\w+)", text, re.MULTILINE)
            returned = whole.split(f'"js/{module}": ((')[1].split("\n}),\n")[0].rsplit("return {", 1)[1]
            assert exported, module
            assert re.findall(r"\w+", returned) == exported, module


def test_the_bundle_of_a_page_has_what_the_entry_point_has_not() -> None:
    bundles = of_sources()
    entry, page = (bundles.content(f"bundles/{name}") for name in ("main.js", "pages/explore.js"))
    named = [set(re.findall(r'^"(js/[^"]+)": \(', text, re.MULTILINE)) for text in (entry, page)]
    assert {"js/core/router.js", "js/core/plotly.js"} <= named[0]
    assert {"js/pages/explore.js", "js/explore/version_view.js"} <= named[1]
    assert not named[0] & named[1]


@pytest.mark.skipif(shutil.which("node") is None, reason="no node (on Debian: apt-get install nodejs npm)")
def test_a_bundle_does_what_its_modules_do(tmp_path: Path) -> None:
    bundles = Bundles(SOURCES.__getitem__)
    (tmp_path / "package.json").write_text('{"type": "module"}')
    written = SOURCES | {name: bundles.content(name) for name in ("bundles/main.js", "bundles/pages/p.js")}
    for name, text in written.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    outputs = [
        subprocess.run(["node", tmp_path / name], capture_output=True, text=True, check=True).stdout
        for name in (ENTRY, "bundles/main.js")
    ]
    assert outputs == ["9 7,8 3 q 10 true\n"] * 2


@pytest.mark.parametrize(
    ("form", "said"),
    [
        ("export { a };\n", "export { a }"),
        ("export default 1;\n", "export default 1"),
        ("export let a = 1;\n", "export let a"),
        ('import * as a from "./core/a.js";\n', "import \\* as a"),
        ('import { named } from "./core/c.js";\n', "js/core/c.js -> js/core/d.js -> js/core/c.js"),
    ],
)
def test_a_form_that_no_bundle_has_is_refused(form: str, said: str) -> None:
    ring = {
        "js/core/c.js": 'import { d } from "./d.js";\nexport const named = d;\n',
        "js/core/d.js": 'import { named } from "./c.js";\nexport const d = named;\n',
    }
    bundles = Bundles({**SOURCES, **ring, "js/main.js": form}.__getitem__)
    with pytest.raises(ValueError, match=said.replace("{", r"\{")):
        bundles.content("bundles/main.js")


def test_every_route_of_the_entry_point_is_known_to_the_documents() -> None:
    bundles = of_sources()
    assert len(bundles.routes) == (FOLDER / ENTRY).read_text(encoding="utf-8").count("\nroute(")
    modules = {"/campaigns/new": "campaign_new", "/campaigns/7": "campaign", "/units/A%201": "unit", "/": "start"}
    for path, module in modules.items():
        route = bundles.route_of(path)
        assert route is not None
        assert route.module == f"js/pages/{module}.js"
    assert bundles.route_of("/nowhere/7") is None


def test_the_document_of_a_page_names_its_bundle_before_the_entry_point_and_plotly_where_figures_are() -> None:
    app = FastAPI()
    install(app)
    client = TestClient(app)
    for path, module, has_figures in (("/units/A1", "unit", True), ("/units", "units", False)):
        document = client.get(path).text
        assert document.index(f"bundles/pages/{module}.js") < document.index("bundles/main.js")
        assert ("plotly-cartesian.js" in document) == has_figures
        assert (
            client.get(re.findall(r'src="([^"]+/pages/[^"]+)"', document)[0])
            .headers["content-type"]
            .startswith("text/javascript")
        )


def test_the_style_sheet_is_all_sheets_in_their_order() -> None:
    bundle = of_sources().content("bundles/main.css")
    assert "@import" not in bundle
    ordered = [(FOLDER / "css" / name).read_text(encoding="utf-8") for name in ("tokens.css", "base.css", "print.css")]
    positions = [bundle.index(text) for text in ordered]
    assert positions == sorted(positions)
    for sheet in (FOLDER / "css").rglob("*.css"):
        if sheet.name != "main.css":
            assert sheet.read_text(encoding="utf-8") in bundle, sheet.name
