"""Certificates in words: a line of the list, and the state of one."""

from __future__ import annotations

from labctl.answers.certificates import CertificateResponse


def list_line(row: CertificateResponse) -> str:
    """Return the line of a certificate in the list of a unit."""
    text = f"{row.number}  version {row.version}, issued {row.issued_at:%Y-%m-%d} by {row.by}"
    text += f", signed by {row.signed_by.subject}" if row.signed_by else ""
    text += f", replaces {row.replaces}: {row.reason}" if row.replaces else ""
    return "; ".join([text, state_text(row), *row.notices])


def state_text(answer: CertificateResponse) -> str:
    """Return the state of a certificate in words."""
    if answer.state == "valid" or answer.state_since is None:
        return answer.state
    reason = f" ({answer.state_reason})" if answer.state_reason else ""
    instead = f"valid instead: {answer.valid_instead}" if answer.valid_instead else "none is valid instead"
    return f"{answer.state} since {answer.state_since:%Y-%m-%d %H:%M} UTC by {answer.state_by}{reason}; {instead}"
