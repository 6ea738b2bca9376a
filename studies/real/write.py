"""`python -m studies.real.write`: write the page of real gyros anew."""

from __future__ import annotations

from datetime import UTC, datetime

from studies.real.page import PAGE, page

if __name__ == "__main__":
    PAGE.write_text(page(f"{datetime.now(UTC):%Y-%m-%d}"), encoding="utf-8")
    print(PAGE)
