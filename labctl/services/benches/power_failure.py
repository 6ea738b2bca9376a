"""Whether the power failed: a host that has another boot id than before was switched off in between."""

from __future__ import annotations

from pathlib import Path

BOOT_ID = Path("/proc/sys/kernel/random/boot_id")


def boot_id() -> str | None:
    """Return what names this run of the host's kernel; None where the system does not tell."""
    try:
        return BOOT_ID.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError):
        return None


def power_failed(before: str | None, now: str | None) -> bool:
    """Return whether the units must be taken to have been off; not knowing counts as yes, a session costs little."""
    return before is None or now is None or before != now
