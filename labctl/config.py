"""Defaults: the database, keys, the user's name, the interval of calibrations, and who certifies."""

from __future__ import annotations

import os
from pathlib import Path

DATABASE_VARIABLE = "LABCTL_DATABASE"
KEY_VARIABLE = "LABCTL_KEY"
DUE_VARIABLE = "LABCTL_DUE_DAYS"
TWO_PERSON_VARIABLE = "LABCTL_TWO_PERSON_RELEASE"
SEAL_KEY_VARIABLE = "LABCTL_SEAL_KEY"
SIGN_KEY_VARIABLE = "LABCTL_SIGN_KEY"
SIGN_CERTIFICATE_VARIABLE = "LABCTL_SIGN_CERTIFICATE"
SIGN_PASSWORD_VARIABLE = "LABCTL_SIGN_PASSWORD_FILE"  # noqa: S105  the name of the variable
SIGNER_VARIABLE = "LABCTL_EXPECTED_SIGNER"
LOG_LEVEL_VARIABLE = "LABCTL_LOG_LEVEL"
FLEET_ENGINE_VARIABLE = "LABCTL_FLEET_ENGINE"
FLEET_SOURCE_VARIABLE = "LABCTL_FLEET_SOURCE"


def variable(name: str) -> str:
    """Return a variable of the environment; empty where it is not set, or holds spaces only."""
    return os.environ.get(name, "").strip()


def key() -> str | None:
    """Return the API key to show to a service, where the environment has one."""
    return os.environ.get(KEY_VARIABLE) or None


def seal_key() -> str:
    """Return what names the key that signs manifests: a PEM file or a PKCS#11 URI; empty for none."""
    return variable(SEAL_KEY_VARIABLE)


def fleet_engine() -> str:
    """Return the cluster that a service may use for work on many units, as dask://HOST:PORT; empty for none."""
    return variable(FLEET_ENGINE_VARIABLE)


def fleet_source() -> str:
    """Return the URL of the storage that a service may read published recordings from; empty for none."""
    return variable(FLEET_SOURCE_VARIABLE)


def os_user() -> str:
    """Return the operating system's name of the user who runs this process."""
    import pwd  # noqa: PLC0415

    try:
        return pwd.getpwuid(os.getuid()).pw_name
    except KeyError:
        return f"uid {os.getuid()}"


def default_database() -> str:
    """Return the database to use: the environment's, else `labctl.sqlite` in the user's data folder."""
    if named := os.environ.get(DATABASE_VARIABLE):
        return named
    from platformdirs import user_data_path  # noqa: PLC0415  the command line starts in a tenth of a second

    folder = user_data_path("labctl")
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    return str(Path(folder) / "labctl.sqlite")
