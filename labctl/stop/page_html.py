"""The page in place of the service's pages, as HTML: no script, no other file, for a person who wants to stop a bench.

What matters is read from some metres away: whether the bench is stopped, and one button. The button is a form, so that
it works in every browser; where keys are asked for, the form asks for one.
"""

from __future__ import annotations

import html

from instruments.clock import WallClock

#: The page asks for its state again after this; later where a person has to enter a key meanwhile, s.
AGAIN_S, AGAIN_WITH_KEY_S = 3, 30
BENCH_PAGE = "/bench"
STYLE = """
:root{color-scheme:light dark;--back:#fff;--text:#17212b;--muted:#51606e}
@media (prefers-color-scheme:dark){:root{--back:#0f141a;--text:#e3e9ef;--muted:#a3b1be}}
*{box-sizing:border-box}
body{margin:0;min-height:100vh;padding:1.5rem;display:flex;flex-direction:column;align-items:center;justify-content:center;
gap:1.5rem;text-align:center;background:var(--back);color:var(--text);font:1.35rem/1.4 system-ui,sans-serif}
h1{margin:0;font-size:clamp(2.25rem,8vw,4.5rem);line-height:1.1}
p{margin:0;max-width:40ch;overflow-wrap:anywhere}
form{display:flex;flex-direction:column;gap:1rem;width:min(30rem,100%)}
input,button{font:inherit;padding:1rem;border-radius:.5rem;width:100%}
input{border:2px solid var(--muted);background:var(--back);color:var(--text)}
label{text-align:left}
button{font-size:clamp(1.75rem,6vw,2.5rem);font-weight:bold;padding:1.5rem;background:#b00020;color:#fff;
border:4px solid #b00020;cursor:pointer}
button:focus-visible,input:focus-visible{outline:4px solid #1f5fa8;outline-offset:3px}
.small{font-size:1rem;color:var(--muted)}
.bad{--back:#b00020;--text:#fff;--muted:#fff}
.bad h1{font-size:clamp(2.75rem,11vw,6.5rem)}
.bad button{background:#fff;color:#b00020;border-color:#fff}
.bad input{background:#fff;color:#17212b}
.good h1{color:#007a52}
@media (prefers-color-scheme:dark){.good h1{color:#58c48d}}
"""


def running(text: str, asks_for_key: bool) -> str:
    """Return the page while no stop was asked for; `text`: what runs."""
    return _page("", "labctl does not answer", text, "Stop the bench", asks_for_key)


def not_stopped(text: str, asks_for_key: bool) -> str:
    """Return the page of a stop after which it is not confirmed that the table stands; `text`: what keeps it."""
    return _page("bad", "NOT STOPPED. Use the stop switch.", text, "Stop again", asks_for_key)


def stopped(text: str, asks_for_key: bool) -> str:
    """Return the page of a stop after which it is confirmed that the table stands."""
    return _page("good", "Stopped. The table stands.", text, "Stop again", asks_for_key)


def _page(kind: str, title: str, text: str, act: str, asks_for_key: bool) -> str:
    again_s = AGAIN_WITH_KEY_S if asks_for_key else AGAIN_S
    key = '<label>Key of an operator<input type="password" name="key" required autocomplete="off"></label>'
    return f"""<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{html.escape(title)} labctl</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="refresh" content="{again_s};url={BENCH_PAGE}"><style>{STYLE}</style></head>
<body class="{kind}"><h1 role="{"alert" if kind == "bad" else "status"}">{html.escape(title)}</h1>
<p>{html.escape(_sentence(text))}</p>
<form method="post" action="/api/stop">{key if asks_for_key else ""}<button>{act}</button></form>
<p class="small">State at {WallClock().utc():%H:%M:%S} UTC. The service of labctl is gone or starts again; this page
asks again every {again_s} s. On the bench's computer <code>labctl stop</code> does the same.</p></body></html>"""


def _sentence(text: str) -> str:
    text = text.strip()
    return text[:1].upper() + text[1:] + ("" if text.endswith(".") else ".")
