"""Messages of a ROS topic by rosbridge: JSON over WebSocket (protocol v2), one line for each message.

`labctl.recording.line_stream` reads the lines, and converts the SI units of a sensor_msgs/Imu there.
"""

from __future__ import annotations

import json
from contextlib import ExitStack

from websockets.exceptions import ConnectionClosed, InvalidURI, WebSocketException
from websockets.sync.client import ClientConnection, connect

from labctl.errors import BadInput

SCHEMES = ("ws://", "wss://")
#: So long connecting, and closing, may take, s.
CONNECT_WITHIN_S, CLOSE_WITHIN_S = 10.0, 1.0
#: Messages that one call takes at most: more waits for the next.
MOST_MESSAGES = 4096
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
        found: list[bytes] = []
        try:
            while self._connection is not None and len(found) < MOST_MESSAGES:
                if line := self._line(self._connection.recv(timeout=0)):
                    found.append(line)
        except TimeoutError:  # nothing more has arrived
            pass
        except ConnectionClosed:
            self._connection = None
            return b"".join(found) or None
        return b"".join(found) if found or self._connection is not None else None

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
