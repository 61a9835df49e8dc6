"""A real HTTP server on loopback that sends an MJPEG stream, and can be cut and brought back."""

import threading
import time
from collections.abc import Sequence
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import cv2
import numpy as np


class MjpegServer:
    """Sends pictures over and over as ``multipart/x-mixed-replace``, at an even rate.

    Parameters
    ----------
    pictures : what to send; bytes are sent as they are, so that a frame can be corrupt.
    rate_hz : frames in a second.
    port : to listen on; 0 takes a free one.
    repeat : how many frames are sent in all to one client; then the connection is kept open without more.

    Attributes
    ----------
    sent_s : when each frame was sent, by ``time.monotonic()``, the last client's.
    """

    def __init__(
        self, pictures: Sequence[np.ndarray | bytes], rate_hz: float, port: int = 0, repeat: int = 1_000_000
    ) -> None:
        self._encoded = [
            picture if isinstance(picture, bytes) else cv2.imencode(".jpg", picture)[1].tobytes()
            for picture in pictures
        ]
        self._period_s, self._repeat = 1 / rate_hz, repeat
        self._stop = threading.Event()
        self.sent_s: list[float] = []
        serve = self._serve

        class Handler(BaseHTTPRequestHandler):
            def log_message(self, format: str, *args: object) -> None:
                pass

            def do_GET(self) -> None:
                serve(self)

        self._server = ThreadingHTTPServer(("127.0.0.1", port), Handler)
        self._thread = threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.02})
        self._thread.start()

    @property
    def port(self) -> int:
        return self._server.server_port

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}/camera.mjpg"

    def _serve(self, request: BaseHTTPRequestHandler) -> None:
        request.send_response(200)
        request.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
        request.end_headers()
        self.sent_s.clear()
        due_s = time.monotonic()
        for number in range(self._repeat):
            if self._stop.wait(max(0.0, due_s - time.monotonic())):
                break
            due_s += self._period_s
            data = self._encoded[number % len(self._encoded)]
            head = f"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {len(data)}\r\n\r\n".encode()
            try:
                self.sent_s.append(time.monotonic())
                request.wfile.write(head + data + b"\r\n")
            except OSError:
                break
        else:
            self._stop.wait(30)
        request.close_connection = True

    def close(self) -> None:
        """Cut all connections and let go of the port."""
        self._stop.set()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def __enter__(self) -> "MjpegServer":
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
