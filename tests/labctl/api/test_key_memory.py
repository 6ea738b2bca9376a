"""The keys in force from memory: known at once, new ones after one reading, and none while the database is frozen."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path
from unittest.mock import patch

import pytest

from labctl.answers.admin import KeyRequest, Role
from labctl.errors import NotIdentified
from labctl.services.admin import key_memory
from labctl.services.admin.api_keys import create_key, revoke_key
from labctl.services.admin.key_memory import KeyMemory
from labctl.store import Store, open_store

NOW = datetime(2026, 1, 5, tzinfo=UTC)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as made:
        yield made


@pytest.fixture
def memory(store: Store) -> Iterator[KeyMemory]:
    with patch.object(key_memory, "READ_S", 1000.0):  # it reads only when it is asked to
        made = KeyMemory(store)
        made.start()
        yield made
        made.close()


def key_of(store: Store, name: str) -> str:
    return create_key(store, KeyRequest(name=name, role=Role.OPERATOR), NOW).key


def caller(memory: KeyMemory, key: str, scheme: str = "Bearer") -> str:
    """Ask in a thread: a browser that another test of this process has opened leaves its event loop in this one."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(lambda: asyncio.run(memory.caller_of(f"{scheme} {key}"))).result().name


def test_a_key_that_was_made_since_the_last_reading_is_known_at_once(store: Store, memory: KeyMemory) -> None:
    with patch.object(key_memory, "NEW_KEY_S", 100.0):
        assert caller(memory, key_of(store, "ada")) == "ada"
        assert caller(memory, key_of(store, "bo")) == "bo"


def test_a_key_that_is_not_in_force_is_refused(store: Store, memory: KeyMemory) -> None:
    key = key_of(store, "ada")
    revoke_key(store, "ada", "lost", NOW)
    for each in (key, "labctl_unknown"):
        with pytest.raises(NotIdentified, match="unknown or revoked"):
            caller(memory, each)
    with pytest.raises(NotIdentified):
        caller(memory, key, "Basic")


def test_while_the_database_is_frozen_known_keys_are_taken_and_others_refused(store: Store, memory: KeyMemory) -> None:
    known = key_of(store, "ada")
    assert caller(memory, known) == "ada"
    begun, thawed = threading.Event(), threading.Event()

    def frozen() -> list[object]:
        begun.set()
        thawed.wait()
        return []

    with patch.object(store.keys, "all", frozen), patch.object(key_memory, "NEW_KEY_S", 0.01):
        for _ in range(3):
            with pytest.raises(NotIdentified):
                caller(memory, "labctl_unknown")
        assert begun.wait(100)
        assert caller(memory, known) == "ada"
        thawed.set()
