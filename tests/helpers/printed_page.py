"""A page as it is printed: the PDF of the browser, and the text and the picture of each of its sheets."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from playwright.sync_api import Page

MARGIN = dict.fromkeys(("top", "right", "bottom", "left"), "10mm")


def sheets_of(page: Page, folder: Path) -> list[list[str]]:
    """Return the lines of each sheet of A4, as they stand beside each other; empty lines are left out."""
    reader = shutil.which("pdftotext")
    if reader is None:
        pytest.skip("no pdftotext (on Debian: apt-get install poppler-utils)")
    file = folder / "printed.pdf"
    page.pdf(path=str(file), format="A4", margin=MARGIN)
    done = subprocess.run([reader, "-layout", str(file), "-"], capture_output=True, text=True, check=True)
    sheets = done.stdout.removesuffix("\f").split("\f")
    return [[line.strip() for line in sheet.splitlines() if line.strip()] for sheet in sheets]


def pixels_of(page: Page, folder: Path) -> list[NDArray[np.uint8]]:
    """Return the picture of each sheet of A4, a pixel for each CSS px, as the browser prints without backgrounds."""
    reader = shutil.which("pdftoppm")
    if reader is None:
        pytest.skip("no pdftoppm (on Debian: apt-get install poppler-utils)")
    file = folder / "printed.pdf"
    page.pdf(path=str(file), format="A4", margin=MARGIN, print_background=False)
    subprocess.run([reader, "-r", "96", "-png", str(file), str(folder / "sheet")], check=True)
    return [np.asarray(Image.open(sheet).convert("RGB")) for sheet in sorted(folder.glob("sheet*.png"))]
