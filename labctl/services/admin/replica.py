"""How old the data are that a service reads from a replica: asked for once a second, so that no page has to ask."""

from __future__ import annotations

from instruments.clock import Clock
from labctl.answers.service import ReplicaResponse
from labctl.services.background import BackgroundWork
from labctl.store import Store


class ReplicaWatch:
    """The age of the data, as the database reported it last. While it does not answer, the data grow older."""

    def __init__(self, store: Store, clock: Clock) -> None:
        self._store, self._clock = store, clock
        self._known: tuple[ReplicaResponse, float] | None = None
        self.background = BackgroundWork("replica", "replica.not_asked", clock, self.tick)

    def tick(self) -> None:
        """Ask the database. Raises StoreError where it does not answer."""
        asked_s = self._clock.now_s()
        state = replica(self._store)
        self._known = None if state is None else (state, asked_s)

    def state(self) -> ReplicaResponse | None:
        """Return how old the data are now; None where the database is no replica, or has not answered yet."""
        if self._known is None:
            return None
        known, asked_s = self._known
        age_s = None if known.age_s is None else round(known.age_s + self._clock.now_s() - asked_s, 1)
        return known.model_copy(update={"age_s": age_s})


def replica(store: Store) -> ReplicaResponse | None:
    """Return how old the data of a replica are; None where the database is none. Raises StoreError."""
    if not store.is_shared:
        return None
    state = store.replication.state()
    if state is None:
        return None
    age_s = None if state.age_s is None else round(max(state.age_s, 0.0), 1)
    return ReplicaResponse(last_change_at=state.last_change_at, age_s=age_s, is_connected=state.is_connected)
