"""What a user or a maintainer reads is plain technical English: none of the banned words is in it.

Banned are private metaphors, pronouns that stand for an unnamed person or process, and figures of speech of which a
reader has to guess the meaning. Beside each is what to write.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

import pytest

from tests.helpers.written_text import (
    Written,
    documentation,
    field_descriptions,
    page_strings,
    python_comments,
    python_strings,
)

BANNED = {
    r"houses?": "name the package, the service or the laboratory",
    r"rooms": "packages, layers",
    r"crew": "operator, process",
    r"shelf|shelves": "cache, catalogue",
    r"(?:the|its) heart": "core, engine",
    r"at the door": "where a request comes in",
    r"in(?:to)? the shield": "name the limit or the check",
    r"(?:the|a) wall(?:'s|’s)?": "real time, the system clock",
    r"wall seconds?": "seconds of real time",
    r"what there is": "catalogue, list",
    r"the local one": "that of this computer",
    r"nobody(?:'s)?|no-one": "say which user, process or answer is missing",
    r"somebody(?:'s)?|someone(?:'s)?": "a person, another process",
    r"anybody(?:'s)?|anyone(?:'s)?|everybody(?:'s)?|everyone(?:'s)?": "every user, every caller",
    r"whoever|whomever": "the caller, the process that",
    r"of one's own|one's own": "your own, its own",
    r"onlookers?": "clients, viewers",
    r"strangers?": "other users, other sites",
    r"glance[sd]?(?: at)?": "read, poll",
    r"the story": "name what is printed",
    r"(?:came|come|comes) of it": "result, campaign that began",
    r"let(?:s|ting)? go of": "release",
    r"for ever": "without end, permanently",
    r"told": "reported, shown, commanded, distinguished",
    r"t(?:ake|akes|aken|aking|ook) (?:it )?up": "resume",
    r"in doubt": "unconfirmed",
    r"look(?:s|ed|ing)? at": "inspect, check, read, compare",
    r"(?:is|was|not|been|last|nothing|something) heard(?: of)?": "answers, last answer, sign of life",
    r"held against|h(?:old|olds|olding) \w+ against": "compared with",
    r"speaks? (?:for itself|against|of)": "objection, evidence",
    r"cut short": "interrupted, truncated",
    r"all the same": "nevertheless",
    r"mend(?:s|ed|ing)?": "correct, repair",
    r"tell(?:s|ing)? (?:them |it )?apart": "distinguish",
    r"nothing of (?:this|the) act": "nothing was stored",
    r"version as it is|applied as it is": "without refitting",
    r"climb(?:s|ing)?|lets? go|comes? true|stands? twice": "name what happens",
    r"(?:an older|a newer|this|another) labctl(?:'s)?": "an older version of labctl, another process of labctl",
    r"comes? on top": "is included, is not included",
    r"(?:bytes|letters|text|reply|protocol number \w+) came": "arrived",
    r"deg came out": "the unit turned by",
    r"t(?:ake|akes|aken|aking|ook) no further part": "is excluded",
    r"nothing of it (?:is|was) kept": "nothing was stored, nothing was imported",
    r"sa(?:y|ys|id) nothing of itself": "reported no identification",
}
WORDS = {phrase: re.compile(rf"\b(?:{phrase})\b", re.IGNORECASE) for phrase in BANNED}
#: Any of them: most texts have none, and are read once.
ANY = re.compile("|".join(pattern.pattern for pattern in WORDS.values()), re.IGNORECASE)
#: Data of the database and of requests that stay as they are.
KEPT = {
    ("labctl/api/middleware.py", "nobody"),
    ("labctl/services/lab_service.py", "look at the bench"),
    ("labctl/answers/service.py", "look at the bench"),
}
#: Recognises reasons that older versions wrote into the database.
OLD_REASONS = "labctl/services/campaigns/failure_advice.py"


def hits(texts: list[Written]) -> list[str]:
    """Return where a banned word is, with what to write."""
    return [
        f"{where}: {found[0]!r}: write {BANNED[phrase]}"
        for where, text in texts
        if ANY.search(text)
        for phrase, pattern in WORDS.items()
        for found in pattern.finditer(text)
        if (where.partition(":")[0], text) not in KEPT
        and not (OLD_REASONS in where and any(old in text for old in ("taken up|", "nothing heard|")))
    ]


@pytest.mark.parametrize("written", [documentation, field_descriptions, page_strings], ids=lambda each: each.__name__)
def test_no_banned_word_is_read(written: Callable[[], Iterator[Written]]) -> None:
    texts = list(written())
    assert len(texts) > 100
    found = hits(texts)
    assert not found, "\n".join(["plain technical English, please:", *found])


@pytest.mark.parametrize("written", [python_strings, python_comments], ids=lambda each: each.__name__)
def test_no_banned_word_is_read_in_the_code(written: Callable[[re.Pattern[str]], Iterator[Written]]) -> None:
    """All strings and comments of the files that have one of the words anywhere in their text."""
    texts = list(written(ANY))
    assert len(texts) > 100
    found = hits(texts)
    assert not found, "\n".join(["plain technical English, please:", *found])


@pytest.mark.parametrize(
    "text",
    [
        "It leaves the house",
        "X times as fast as the wall",
        "Of TIME and LINE; default: the local one",
        "Nobody has made the bench safe",
        "Ask whoever is at the terminal.",
        "the rooms people enter",
        "The campaign is taken up again",
        "Look at the bench",
        "Service last heard 3 s ago",
        "a model held against a recording",
        "made by an older labctl",
        "only 300 deg came out of 360 about x",
    ],
)
def test_a_banned_word_is_found(text: str) -> None:
    assert hits([("page.md:1", text)])


@pytest.mark.parametrize(
    "text",
    ["Close the chamber's door.", "room temperature", "make room on the disk", "/health/heartbeat", "a wallpaper"],
)
def test_a_plain_word_is_left_alone(text: str) -> None:
    assert not hits([("page.md:1", text)])
