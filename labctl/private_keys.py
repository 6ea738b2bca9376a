"""Where private keys are kept: a file of their owner's, or a PKCS#11 token (RFC 7512 names a key of it)."""

from __future__ import annotations

import stat
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote

from labctl.errors import BadInput

if TYPE_CHECKING:
    from pkcs11 import Session

SCHEME = "pkcs11:"


@dataclass(frozen=True)
class KeyUse:
    """What a key is for, as messages name it."""

    name: str
    variable: str  #: of the environment, that names the key
    make: str = ""  #: how to get such a key; begins with "; "


def refuse_open_key(path: Path, use: KeyUse) -> None:
    """Raise BadInput for a key file that is missing, or that others than its owner can read or write."""
    try:
        mode = path.stat().st_mode
    except OSError as error:
        raise BadInput(
            f"{use.name} {path}: {error.strerror}; name an existing file by {use.variable}{use.make}"
        ) from error
    if mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise BadInput(
            f"{use.name} {path}: its mode is {stat.S_IMODE(mode):04o}, so others than its owner have access to it; "
            f"run `chmod 600 {path}`"
        )


@dataclass(frozen=True)
class TokenUri:
    """A key of a PKCS#11 token, as RFC 7512 names it."""

    token: str
    object: str
    module: str
    pin: str

    @property
    def named(self) -> str:
        """Token and object, without the PIN."""
        return f"{SCHEME}token={self.token};object={self.object}"


def token_uri(text: str, use: KeyUse) -> TokenUri:
    """Read `pkcs11:token=T;object=O?module-path=FILE&pin-source=FILE`. Raises BadInput; no message shows a PIN."""
    path, _, query = text.removeprefix(SCHEME).partition("?")
    try:
        parts = dict(_attribute(part) for part in [*path.split(";"), *query.split("&")] if part)
    except ValueError as error:
        raise BadInput(f"{use.variable}: an attribute of the PKCS#11 URI has no '='; write token=NAME") from error
    if missing := [name for name in ("token", "object", "module-path") if not parts.get(name)]:
        raise BadInput(
            f"{use.variable}: the PKCS#11 URI has no {', '.join(missing)}; write "
            "pkcs11:token=NAME;object=NAME?module-path=FILE&pin-source=FILE"
        )
    return TokenUri(parts["token"], parts["object"], parts["module-path"], _pin(parts, use))


def _attribute(part: str) -> tuple[str, str]:
    name, value = part.split("=", 1)
    return name, unquote(value)


def _pin(options: dict[str, str], use: KeyUse) -> str:
    if "pin-value" in options:
        return options["pin-value"]
    if "pin-source" not in options:
        return ""
    return read_secret(Path(options["pin-source"].removeprefix("file:")), use)


def read_secret(path: Path, use: KeyUse) -> str:
    """Return a PIN or password from a file of its owner's. Raises BadInput."""
    refuse_open_key(path, use)
    return path.read_text(encoding="utf-8").strip()


def open_session(uri: TokenUri) -> Session:
    """Log in to a token; returns a session of python-pkcs11. Raises pkcs11.PKCS11Error, RuntimeError."""
    import pkcs11  # noqa: PLC0415  only where a token is used
    from pkcs11.exceptions import UserAlreadyLoggedIn  # noqa: PLC0415  as above

    token = pkcs11.lib(uri.module).get_token(token_label=uri.token)
    try:
        return token.open(user_pin=uri.pin or None)
    except UserAlreadyLoggedIn:  # a process logs in once
        return token.open()
