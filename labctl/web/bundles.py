"""The modules and style sheets of a page in a few files, made from the sources when a browser first asks for them.

A page is some hundred modules. Each of them as a request of its own costs the browser and the service more time than
its content; and a browser sees what a module imports only when it has read it, so that requests wait for one another.
The sources stay as they are: plain modules, which a browser, node and the tests also load one by one.

A bundle has each module as a function of its own (so that names of two modules never meet), which is called when it is
first imported, and once in a page, whichever bundle it came with. `main.js` is the entry point and what it imports;
every other bundle is of a module that `import()` names, with all that it needs beside the entry point. The document of
a page has the bundle of that page before the entry point, which so finds it there; others are loaded when needed.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

ENTRY = "js/main.js"
#: Names of bundles begin with it; what follows is the name of the module or style sheet below `js/` or `css/`.
PREFIX = "bundles/"
PLOTLY_BUILD = "plotly-cartesian.js"

#: The forms that the sources use (a test reads every one of them); any other is refused.
IMPORT = re.compile(r'^import \{([^}]*)\} from "(\.[^"]+)";$', re.MULTILINE)
EXPORT = re.compile(r"^export ((?:async )?function\*? |const |class )(\w+)", re.MULTILINE)
RENAMED = re.compile(r"(\w+) as (\w+)")
LATER = re.compile(r'\bimport\("(\.[^"]+)"\)')
UNKNOWN = re.compile(
    r"^export (?!(?:async )?function\*? \w|const \w|class \w).*$|^import [\"\w*].*[\"'];$", re.MULTILINE
)
ROUTE = re.compile(
    r'route\(\s*"(?P<pattern>[^"]+)",\s*"[^"]*",\s*(?P<plots>withPlots\()?\(\) => import\("(?P<module>\.[^"]+)"\)'
)
SHEET = re.compile(r'^@import "([^"]+)";$', re.MULTILINE)

#: The functions of all bundles of a page are in one object, from which the entry point takes them.
KNOWN = "(globalThis.labctlModules ??= {})"
HEAD = f"""\
const $known = {KNOWN}, $made = new Map();
const $url = (name) => new URL(`../${{name}}`, import.meta.url).href;
const $take = (name) => {{
  if (!$made.has(name)) $made.set(name, $known[name]($take, $later, $url));
  return $made.get(name);
}};
const $later = async (name) => {{
  if (!(name in $known)) await import($url(`bundles/${{name.slice(3)}}`));
  return $take(name);
}};
"""


@dataclass(frozen=True)
class Route:
    """A kind of address: its pattern such as `/units/:serial`, its module, and whether it shows figures."""

    pattern: str
    module: str
    has_plots: bool

    def matches(self, path: str) -> bool:
        """Return whether a path is of this kind."""
        parts = [r"[^/]+" if part.startswith(":") else re.escape(part) for part in self.pattern.split("/")]
        return re.fullmatch("/".join(parts) or "/", path) is not None


@dataclass(frozen=True)
class Bundles:
    """Bundles of one state of the sources; `read` returns the text of a file by its name, such as `js/main.js`."""

    read: Callable[[str], str]
    _texts: dict[str, str] = field(default_factory=dict)

    @staticmethod
    def source_of(name: str) -> str:
        """Return the name of the file that a bundle begins with; empty for a name that is of no bundle."""
        if not name.startswith(PREFIX):
            return ""
        source = name.removeprefix(PREFIX)
        return f"{'css' if source.endswith('.css') else 'js'}/{source}"

    def content(self, name: str) -> str:
        """Return a bundle by its name, such as `bundles/main.js`. Raises KeyError where there is no such file."""
        module = self.source_of(name)
        if module.endswith(".css"):
            return self._style(module)
        if module == ENTRY:
            inner = [each for each in self._entry if each != ENTRY]
            return f"{self._functions(inner)}{HEAD}{self._body(ENTRY)[0]}"
        return self._functions([each for each in self._closure(module) if each not in self._entry])

    def route_of(self, path: str) -> Route | None:
        """Return the kind of the address of a page; None where there is no such page."""
        return next((route for route in self.routes if route.matches(path)), None)

    @cached_property
    def routes(self) -> tuple[Route, ...]:
        """The addresses of all pages, in the order in which they are tried."""
        return tuple(
            Route(found["pattern"], _beside(ENTRY, found["module"]), found["plots"] is not None)
            for found in ROUTE.finditer(self._text(ENTRY))
        )

    @cached_property
    def _entry(self) -> tuple[str, ...]:
        return self._closure(ENTRY)

    def _text(self, name: str) -> str:
        if name not in self._texts:
            self._texts[name] = self.read(name)
        return self._texts[name]

    def _closure(self, module: str) -> tuple[str, ...]:
        """Return a module and all that it imports at once, each after what it imports. Raises ValueError for a ring."""
        found: dict[str, None] = {}
        self._visit(module, (), found)
        return tuple(found)

    def _visit(self, module: str, above: tuple[str, ...], found: dict[str, None]) -> None:
        if module in above:
            ring = " -> ".join([*above[above.index(module) :], module])
            raise ValueError(f"modules import one another in a ring: {ring}; move what both need into a third one")
        if module in found:
            return
        for match in IMPORT.finditer(self._text(module)):
            self._visit(_beside(module, match[2]), (*above, module), found)
        found[module] = None

    def _functions(self, modules: list[str]) -> str:
        """Return the statement that makes modules known: name -> function that runs one and returns what it exports."""
        parts = []
        for module in modules:
            body, names = self._body(module)
            parts.append(f'"{module}": (($take, $later, $url) => {{\n{body}return {{ {", ".join(names)} }};\n}}),\n')
        return f"Object.assign({KNOWN}, {{\n{''.join(parts)}}});\n"

    def _body(self, module: str) -> tuple[str, list[str]]:
        """Return the statements of a module without imports and exports, and the names that it exports.

        Raises ValueError for an import or export in another form than the sources have.
        """
        text = self._text(module)
        if (unknown := UNKNOWN.search(text)) is not None:
            raise ValueError(f"{module}: {unknown[0]!r}; write it as `import {{ name }}` or `export const name`")
        names = [match[2] for match in EXPORT.finditer(text)]
        text = IMPORT.sub(lambda match: _taken(match[1], _beside(module, match[2])), text)
        text = LATER.sub(lambda match: f'$later("{_beside(module, match[1])}")', text)
        text = text.replace("import.meta.url", f'$url("{module}")')
        return EXPORT.sub(r"\1\2", text), names

    def _style(self, name: str) -> str:
        """Return a style sheet with those that it imports in their places."""
        return SHEET.sub(lambda match: self._style(_beside(name, f"./{match[1]}")), self._text(name))


def _beside(module: str, address: str) -> str:
    return posixpath.normpath(posixpath.join(posixpath.dirname(module), address))


def _taken(names: str, module: str) -> str:
    """Return the statement that takes names (`a, b as c`) from another module of a bundle, on as many lines."""
    bound = RENAMED.sub(r"\1: \2", names)
    return f'const {{{bound}}} = $take("{module}");'


def links(bundles: Bundles, path: str) -> str:
    """Return the elements by which the document of a page loads what the page needs beside its entry point."""
    route = bundles.route_of(path)
    if route is None:
        return ""
    module = f"{PREFIX}{route.module.removeprefix('js/')}"
    plots = f'  <script async data-plotly src="/static/{PLOTLY_BUILD}"></script>\n' if route.has_plots else ""
    return f'{plots}  <script type="module" src="/static/{module}"></script>\n'
