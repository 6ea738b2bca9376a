"""The axis of the error ladder, as Plotly draws it: it names figures wherever the errors lie."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Page

#: The error ladder with these errors of its versions, drawn on the page; the figures on its axis.
LADDER = """async (errors) => {
  const { ladderFigure } = await import("/static/js/explore/error_ladder.js");
  const steps = errors.map((rms_dps, k) => ({
    version: k + 1, model: "m", effects: [], rms_dps, raw_rms_dps: 1, heldout_rms_dps: null, recordings: [1],
  }));
  const figure = ladderFigure({ steps, others: [], noise_floor_dps: errors.at(-1), recording: 1, recordings: [1] });
  document.querySelector("main").replaceChildren(figure);
  const drawn = new Promise((resolve) => { figure.ondrawn = resolve; });
  await figure.update();
  await drawn;
  const labels = [...figure.querySelectorAll(".ytick text")];
  return labels.map((each) => [each.textContent, each.getBoundingClientRect().top]);
}"""


@pytest.mark.parametrize("errors", [[0.029, 0.021], [0.0212, 0.0211], [0.09, 0.021], [3.0, 0.0021]])
def test_the_axis_of_the_ladder_has_figures_wherever_the_errors_lie(
    visit: Callable[..., Page], errors: list[float]
) -> None:
    page = visit("/units")
    page.wait_for_selector("main h1")
    ticks = page.evaluate(LADDER, errors)
    texts = [text for text, _ in ticks]
    assert 2 <= len(texts) <= 14, texts
    assert len(set(texts)) == len(texts), texts  # no two are rounded to the same figure
    tops = sorted(top for _, top in ticks)
    assert min(np.diff(tops)) > 11, ticks  # none stands over another
