"""Which feed an address names."""

from __future__ import annotations

import json
import socket
from contextlib import ExitStack

from websockets.exceptions import ConnectionClosed, InvalidURI, WebSocketException
from websockets.sync.client import ClientConnection, connect

from labctl.errors import BadInput
from labctl.services.live.line_feed import MAX_BYTES, DescriptorFeed, LineFeed, SocketFeed, TcpFeed

# Messages of a ROS topic by rosbridge: JSON over WebSocket (protocol v2), one line for each message.
#
# `labctl.recording.line_stream` reads the lines, and converts the SI units of a sensor_msgs/Imu there.

SCHEMES = ("ws://", "wss://")
#: So long connecting, and closing, may take, s.
CONNECT_WITHIN_S, CLOSE_WITHIN_S = 10.0, 1.0
#: Messages that one call takes at most: more waits for the next.
MAX_MESSAGES = 4096
#: An error of the server is quoted up to here.
QUOTED = 200


class RosbridgeFeed:
    """A subscription to one topic of a rosbridge server."""

    may_lose = False

    def __init__(self, address: str, topic: str) -> None:
        """Take ws://HOST:PORT or wss://HOST:PORT, and the name of a topic of type sensor_msgs/Imu."""
        self._address, self._topic = address, topic
        self.name = f"topic {topic} of {address}"
        self._connection: ClientConnection | None = None
        self._opened = ExitStack()

    def open(self) -> None:
        """Connect and subscribe. Raises BadInput where the server does not answer as a WebSocket server."""
        try:
            self._connection = self._opened.enter_context(
                connect(self._address, open_timeout=CONNECT_WITHIN_S, close_timeout=CLOSE_WITHIN_S, proxy=None)
            )
            self._connection.send(json.dumps({"op": "subscribe", "topic": self._topic}))
        except InvalidURI as error:
            raise BadInput(f"{self._address}: no address of a rosbridge server; write ws://HOST:PORT") from error
        except (WebSocketException, OSError) as error:
            raise BadInput(
                f"{self._address}: cannot connect ({error}); check address, and that rosbridge_server runs there: "
                "ros2 launch rosbridge_server rosbridge_websocket_launch.xml"
            ) from error

    def take(self) -> bytes | None:
        """Return the messages that have arrived, one a line; None at the end. Raises BadInput for its error."""
        messages: list[bytes] = []
        try:
            while self._connection is not None and len(messages) < MAX_MESSAGES:
                if line := self._line(self._connection.recv(timeout=0)):
                    messages.append(line)
        except TimeoutError:  # nothing more has arrived
            pass
        except ConnectionClosed:
            self._connection = None
            return b"".join(messages) or None
        return b"".join(messages) if messages or self._connection is not None else None

    def _line(self, received: str | bytes) -> bytes:
        """Return a message as a line; what is none of this topic is left out, what is no JSON is left to the reader."""
        text = received if isinstance(received, str) else received.decode("utf-8", errors="replace")
        try:
            document = json.loads(text)
        except (ValueError, RecursionError):
            return text.replace("\n", " ").encode() + b"\n"
        operation = document.get("op") if isinstance(document, dict) else None
        if operation == "status" and document.get("level") == "error":
            raise BadInput(f"{self.name}: rosbridge says {str(document.get('msg'))[:QUOTED]!r}; check the topic")
        if operation != "publish" or document.get("topic") != self._topic:
            return b""
        return json.dumps(document).encode() + b"\n"

    def close(self) -> None:
        """End the connection; safe to call twice."""
        self._connection = None
        self._opened.close()


UDP = "udp://"
#: Where it listens unless the address names another place: what other computers send does not arrive.
LOOPBACK = "127.0.0.1"
#: Largest datagram.
LARGEST = 1 << 16


class UdpFeed(SocketFeed):
    """A port at which one sender's datagrams arrive; those of a second sender are not taken."""

    may_lose = True

    def __init__(self, address: str) -> None:
        """Take udp://HOST:PORT, the place to listen at; raises BadInput for another form."""
        host, _, port = address.removeprefix(UDP).rpartition(":")
        if not address.startswith(UDP) or not port.isdecimal() or not 0 < int(port) < 65536:
            raise BadInput(
                f"{address}: no address of a stream; give udp://HOST:PORT, HOST being the address of this computer at "
                f"which the datagrams arrive ({LOOPBACK}: from this computer alone; 0.0.0.0: from every network)"
            )
        super().__init__(address)
        self._place = host.strip("[]") or LOOPBACK, int(port)
        self._is_known = False  #: whether the sender is

    def open(self) -> None:
        family = socket.AF_INET6 if ":" in self._place[0] else socket.AF_INET
        udp_socket = socket.socket(family, socket.SOCK_DGRAM)
        try:
            udp_socket.bind(self._place)
        except OSError as error:
            udp_socket.close()
            raise BadInput(
                f"{self.name}: cannot listen there ({error}); name an address of this computer and a free port"
            ) from error
        udp_socket.setblocking(False)
        self._socket, self._is_known = udp_socket, False

    def take(self) -> bytes | None:
        """Return the lines that have arrived, each whole: a datagram without a line end is a line. It has no end."""
        datagram = b""
        while self._socket is not None and len(datagram) < MAX_BYTES:
            try:
                data, sender = self._socket.recvfrom(LARGEST)
                if not self._is_known:
                    self._socket.connect(sender)
                    self._is_known = True
            except BlockingIOError:
                return datagram
            except ConnectionRefusedError:  # the sender is gone: another datagram may come, or silence ends it
                continue
            datagram += data if data.endswith(b"\n") or not data else data + b"\n"
        return datagram


def feed_of(address: str, topic: str) -> LineFeed:
    """Return the feed that --lines names: -, or as `network_feed`. Raises BadInput."""
    return DescriptorFeed(0, "standard input") if address == "-" else network_feed(address, topic)


def network_feed(address: str, topic: str) -> LineFeed:
    """Return the feed of an address: tcp:// or udp://HOST:PORT, or ws://HOST:PORT with a topic.

    Raises BadInput for another.
    """
    if address.startswith(UDP):
        return UdpFeed(address)
    return RosbridgeFeed(address, topic) if address.startswith(SCHEMES) else TcpFeed(address)
