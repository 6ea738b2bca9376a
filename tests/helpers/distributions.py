"""Installed distributions that a test makes: their metadata and one module."""

from __future__ import annotations

from pathlib import Path


def distribution(folder: Path, name: str, entry_points: str, code: str = "", version: str = "0.3") -> None:
    """Write an installed distribution: its metadata, and a module of its name."""
    info = folder / f"{name.replace('-', '_')}-{version}.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n", encoding="utf-8")
    (info / "entry_points.txt").write_text(entry_points, encoding="utf-8")
    (folder / f"{name.replace('-', '_')}.py").write_text(code, encoding="utf-8")
