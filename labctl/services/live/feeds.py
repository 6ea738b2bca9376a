"""Which feed an address names."""

from __future__ import annotations

from labctl.services.live.line_feed import DescriptorFeed, LineFeed, TcpFeed
from labctl.services.live.rosbridge_feed import SCHEMES, RosbridgeFeed
from labctl.services.live.udp_feed import UDP, UdpFeed


def feed_of(given: str, topic: str) -> LineFeed:
    """Return the feed that --lines names: -, or as `network_feed`. Raises BadInput."""
    return DescriptorFeed(0, "standard input") if given == "-" else network_feed(given, topic)


def network_feed(address: str, topic: str) -> LineFeed:
    """Return the feed of an address: tcp:// or udp://HOST:PORT, or ws://HOST:PORT with a topic.

    Raises BadInput for another.
    """
    if address.startswith(UDP):
        return UdpFeed(address)
    return RosbridgeFeed(address, topic) if address.startswith(SCHEMES) else TcpFeed(address)
