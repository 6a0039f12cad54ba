"""moto's S3 server behind a line that can be cut; prints the line's port.

Each line of stdin says how many bytes more reach the server, or `all`; it is echoed.
"""

import socket
import sys
import threading
from contextlib import suppress

from moto.server import ThreadedMotoServer


class Line:
    """Passes connections on to a server; while `left` is a number, only so many bytes more reach it."""

    def __init__(self, port):
        self.left = None
        self._server = "127.0.0.1", port
        self._socket = socket.create_server(("127.0.0.1", 0))
        self.port = self._socket.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self):
        while True:
            client, server = self._socket.accept()[0], socket.create_connection(self._server)
            threading.Thread(target=self._pass, args=(client, server, True), daemon=True).start()
            threading.Thread(target=self._pass, args=(server, client, False), daemon=True).start()

    def _pass(self, source, target, to_server):
        with suppress(OSError):
            while data := source.recv(1 << 14):
                if to_server and self.left is not None:
                    data, self.left = data[: self.left], max(0, self.left - len(data))
                    if not data:
                        break
                target.sendall(data)
        for end in (source, target):
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)


server = ThreadedMotoServer("127.0.0.1", 0, verbose=False)
server.start()
line = Line(server.get_host_and_port()[1])
print(line.port, flush=True)
for said in sys.stdin:
    line.left = None if said.strip() == "all" else int(said)
    print(said, end="", flush=True)
