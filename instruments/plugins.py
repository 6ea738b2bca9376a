"""What installed distributions add to labctl, found by their entry points; labctl's own parts are found the same way.

Names are read from the metadata of the distributions; a plug-in is imported when its name is asked for. One that
cannot be used gives one line that names distribution, entry point and error, and nothing else is affected.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Generic, TypeVar

from instruments.logger import logger

#: Entry-point groups of labctl begin with this.
PREFIX = "labctl."
#: The distribution whose names no other one can take.
OWN = "labctl"
#: An error's text is shown up to here.
LONGEST_ERROR = 300

PluginT = TypeVar("PluginT")
PartT = TypeVar("PartT")
_log = logger(__name__)


class PluginError(Exception):
    """A plug-in that cannot be used; the text is one line that names distribution, entry point and error."""


class UnknownPlugin(PluginError):
    """No installed distribution has an entry point of this name in the group."""


@dataclass(frozen=True)
class Plugin:
    """One entry point of an installed distribution; nothing is imported."""

    group: str
    name: str
    target: str  #: module:object
    distribution: str
    version: str

    @property
    def is_own(self) -> bool:
        """Whether it is part of labctl."""
        return self.distribution == OWN

    @property
    def release(self) -> str:
        """Distribution and version in words."""
        return f"{self.distribution} {self.version}"

    def __str__(self) -> str:
        return f"entry point {self.name!r} ({self.target}) of {self.release} in group {self.group}"

    def load(self) -> object:
        """Import it and return the object; raises whatever the import raises."""
        from importlib import metadata  # noqa: PLC0415  see `installed`

        return metadata.EntryPoint(self.name, self.target, self.group).load()


def summary(error: BaseException) -> str:
    """Return an error of foreign code as one line: its type, and the beginning of its first line."""
    text = next(iter(str(error).splitlines()), "")[:LONGEST_ERROR]
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def failure(plugin: Plugin, what: str, error: BaseException) -> str:
    """Return one line about an error that a plug-in raised while it did `what`."""
    remedy = "install labctl again" if plugin.is_own else f"repair or uninstall {plugin.distribution}"
    return f"{plugin}: cannot {what}: {summary(error)}; {remedy}"


@cache
def installed() -> tuple[Plugin, ...]:
    """Return every entry point of labctl's groups, labctl's own first, then by distribution and name.

    Of two distributions of one name the first on the path counts, as for imports. Metadata that cannot be read is
    logged and left out.
    """
    from importlib import metadata  # noqa: PLC0415  a tenth of the start of a robot's program, which asks for no plug-in

    by_distribution: dict[str, list[Plugin]] = {}
    for distribution in metadata.distributions():
        try:
            text = distribution.read_text("entry_points.txt") or ""
            if f"[{PREFIX}" in text and (name := distribution.metadata["Name"]) not in by_distribution:
                by_distribution[name] = [
                    Plugin(each.group, each.name, each.value, name, distribution.version)
                    for each in distribution.entry_points
                    if each.group.startswith(PREFIX)
                ]
        except Exception as error:  # noqa: BLE001  the metadata of others may hold anything
            _log.warning("entry points of %s cannot be read: %s; it is left out", distribution, summary(error))
    each_of = [plugin for plugins in by_distribution.values() for plugin in plugins]
    return tuple(sorted(each_of, key=lambda p: (not p.is_own, p.distribution, p.name)))


class PluginGroup(Generic[PluginT]):
    """The plug-ins of one group: `labctl.` and what they are, in the plural.

    `noun` is what a message calls one of them. `check` gets a loaded object and returns it as what it has to be, or
    raises TypeError or ValueError saying what it has to be. `advice` ends the message about an unknown name.
    """

    def __init__(self, group: str, noun: str, check: Callable[[object], PluginT], advice: str = "") -> None:
        self.group, self.noun = group, noun
        self._check = check
        self._advice = advice or f"install the package that has it in its group {group}, or correct the name"
        self._loaded: dict[str, PluginT | PluginError] = {}
        self._logged: set[str] = set()

    @cached_property
    def _by_name(self) -> dict[str, list[Plugin]]:
        names: dict[str, list[Plugin]] = {}
        for plugin in installed():
            if plugin.group == self.group:
                names.setdefault(plugin.name, []).append(plugin)
        return names

    @property
    def names(self) -> tuple[str, ...]:
        """Every name, labctl's own first; nothing is imported."""
        return tuple(self._by_name)

    def plugin(self, name: str) -> Plugin:
        """Return the entry point of a name; nothing is imported. Raises UnknownPlugin, PluginError for a doubled name.

        A name of labctl's own stays labctl's own, also where another distribution has it.
        """
        candidates = self._by_name.get(name)
        if not candidates:
            raise UnknownPlugin(self.unknown(name))
        if len(candidates) > 1 and not candidates[0].is_own:
            raise PluginError(self._doubled(candidates))
        return candidates[0]

    def get(self, name: str) -> PluginT:
        """Return the object of a name, imported at first use; raises UnknownPlugin, PluginError."""
        if name not in self._loaded:
            self._loaded[name] = self._load(self.plugin(name))
        loaded = self._loaded[name]
        if isinstance(loaded, PluginError):
            raise loaded
        return loaded

    def all(self) -> dict[str, PluginT]:
        """Return every object by name, labctl's own first; those that cannot be used are logged, once, and left out."""
        usable: dict[str, PluginT] = {}
        for name in self.names:
            try:
                usable[name] = self.get(name)
            except PluginError:
                continue
        for line in self.problems():
            self.report(line)
        return usable

    def merged(self, parts: Callable[[PluginT], Iterable[tuple[str, PartT]]], noun: str) -> dict[str, PartT]:
        """Return the parts of every object by their own names, labctl's own first.

        A name that an earlier plug-in has is left out of the later one; a line about it is logged.
        """
        owner: dict[str, str] = {}
        whole: dict[str, PartT] = {}
        for name, plugin_object in self.all().items():
            for part_name, part in parts(plugin_object):
                if part_name in owner:
                    plugin = self.plugin(name)
                    self.report(
                        f"{plugin}: {noun} {part_name!r} is left out: {owner[part_name]} has one of that name; "
                        f"rename it in {plugin.distribution}, or uninstall one"
                    )
                    continue
                owner[part_name], whole[part_name] = str(self.plugin(name).release), part
        return whole

    def status(self) -> list[tuple[Plugin, str]]:
        """Return every entry point with why it cannot be used, empty where it can; everything is imported."""
        reasons: list[tuple[Plugin, str]] = []
        for name, plugins in self._by_name.items():
            try:
                self.get(name)
                why = ""
            except PluginError as error:
                why = str(error)
            doubled = self._doubled(plugins) if len(plugins) > 1 else ""
            reasons += [(plugin, doubled or why) if plugin is not plugins[0] else (plugin, why) for plugin in plugins]
        return reasons

    def problems(self) -> list[str]:
        """Return one line for each plug-in that cannot be used; everything is imported."""
        return list(dict.fromkeys(why for _, why in self.status() if why))

    def report(self, line: str) -> None:
        """Log a line about a plug-in that is left out, once."""
        if line not in self._logged:
            self._logged.add(line)
            _log.warning("%s", line)

    def unknown(self, name: str, known: Sequence[str] | None = None) -> str:
        """Return one line about a name that is not installed, with those that are (default: all of the group)."""
        names = self.names if known is None else known
        near = difflib.get_close_matches(name, names, n=1)
        hint = f"did you mean {near[0]!r}? If not, " if near else ""
        listed = ", ".join(f"{each} ({self._by_name[each][0].release})" for each in names)
        return (
            f"no {self.noun} {name!r} is installed (installed: {listed or 'none'}); {hint}{self._advice}{self._stale()}"
        )

    def _stale(self) -> str:
        if any(plugins[0].is_own for plugins in self._by_name.values()):
            return ""
        return "; labctl's own are not registered either: install labctl again (`make install`)"

    def _doubled(self, plugins: Sequence[Plugin]) -> str:
        each = " and ".join(f"{plugin.release} ({plugin.target})" for plugin in plugins)
        kept = f"{OWN}'s own is used" if plugins[0].is_own else "none of them is used"
        return (
            f"entry point {plugins[0].name!r} in group {self.group} is of {each}; {kept}: uninstall all but one, "
            "or ask for another name"
        )

    def _load(self, plugin: Plugin) -> PluginT | PluginError:
        try:
            return self._check(plugin.load())
        except (Exception, SystemExit) as error:  # noqa: BLE001  foreign code may raise anything
            return PluginError(failure(plugin, f"load this {self.noun}", error))


def instance_of(kind: type[PluginT]) -> Callable[[object], PluginT]:
    """Return a check that an object is an instance of a class."""

    def check(loaded: object) -> PluginT:
        if not isinstance(loaded, kind):
            raise TypeError(f"{loaded!r} is not a {kind.__module__}.{kind.__qualname__}"[:LONGEST_ERROR])
        return loaded

    return check
