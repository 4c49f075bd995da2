"""The live page of a run: a server for this machine alone, whose page shows the run, pauses it, and
makes events happen.

Orders are events of a scenario's kinds, so a run that was meddled with says in its summary what
happened when.
"""

from __future__ import annotations

import json
import secrets
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from queue import Empty, SimpleQueue
from typing import Any
from urllib.parse import parse_qs, urlsplit

from pydantic import TypeAdapter, ValidationError

from testbed.report.animation import LivePage
from testbed.scenario.events import CutRope, Event, SetFriction, Shove
from testbed.scenario.scenario import Scenario
from testbed.simulation.live_run import Run

EVERY_S, HELD_S = 0.05, 0.05
"""Simulated time between two looks, and how long a run that is held up waits before it asks
again.
"""
MOST_FRAMES, MOST_BYTES = 20_000, 10_000
BEGINS = 503
"""Status of a page that is not there yet: the browser asks again."""
ORDERS = (CutRope, Shove, SetFriction)
_EVENT: TypeAdapter[Event] = TypeAdapter(Event)


class Live:
    """Shows a run on its way under `address` and does what is ordered there; a Watch, and a context
    manager.
    """

    every_s = EVERY_S

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self.page: LivePage | None = None
        self.key = secrets.token_urlsafe(16)
        self.frames: list[list[int]] = []
        self.cells: dict[str, str] = {}
        self.events: list[str] = []
        self.state, self.t_s = "running", 0.0
        self._orders: SimpleQueue[Event] = SimpleQueue()
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), _handler(self))
        self._started: float | None = None

    @property
    def address(self) -> str:
        """Where the page is."""
        return f"http://127.0.0.1:{self._server.server_address[1]}/"

    def __enter__(self) -> Live:
        threading.Thread(target=self._server.serve_forever, args=(HELD_S,), daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self.state = "ended"
        time.sleep(2 * HELD_S)  # the page hears of the end
        self._server.shutdown()
        self._server.server_close()

    # ---- the run's side --------------------------------------------------------------------------

    def look(self, run: Run) -> bool:
        """Show the last row, pass the orders on, and keep to real time; returns whether the run may
        go on.
        """
        if self.state == "paused":
            time.sleep(HELD_S)
            self._started = None
            return False
        self._pass_on(run)
        now = run.now()
        if self.page is None:
            self.page = LivePage(self._scenario, run.robot)
        if now is not None and len(self.frames) < MOST_FRAMES:
            self.frames.append(self.page.frame(*now))
            self.cells = self.page.cells(*now)
        self.events = [
            f"{event['t']:.2f} s  {str(event['kind']).replace('_', ' ')}" for event in run.events
        ]
        self.t_s = run.t_s
        self._keep_time(run.t_s)
        return True

    def _pass_on(self, run: Run) -> None:
        while True:
            try:
                event = self._orders.get_nowait()
            except Empty:
                return
            run.happen(event.kind, **event.model_dump(exclude={"kind", "at_s"}))

    def _keep_time(self, t_s: float) -> None:
        """Wait where the simulation is ahead of the clock."""
        if self._started is None:
            self._started = time.monotonic() - t_s
        time.sleep(max(self._started + t_s - time.monotonic(), 0.0))

    # ---- the browser's side ----------------------------------------------------------------------

    def since(self, after: int) -> dict[str, Any]:
        """What has come since frame number `after`."""
        return {
            "frames": self.frames[max(after, 0) :],
            "cells": self.cells,
            "events": self.events[-20:],
            "state": self.state,
            "t": self.t_s,
        }

    def order(self, body: Any) -> dict[str, str]:
        """Do what the page orders; says what was done, or why not."""
        if isinstance(body, dict) and body.get("kind") == "pause":
            self.state = "running" if self.state == "paused" else "paused"
            return {"done": self.state}
        try:
            event = _EVENT.validate_python({**body, "at_s": 0.0})
        except (ValidationError, TypeError) as error:
            return {"refused": f"is no order: {str(error).splitlines()[0]}"}
        if not isinstance(event, ORDERS):
            return {"refused": "only ropes, pushes and friction change while it runs"}
        self._orders.put(event)
        return {"done": event.kind.replace("_", " ")}


def _handler(live: Live) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        """GET / (the page), GET /frames?after=N, POST /order; the last two for who knows the page's
        key.
        """

        def do_GET(self) -> None:
            """The page, or what has come since."""
            asked = urlsplit(self.path)
            if not self._of_here():
                self._answer(403, b"not from here", "text/plain")
            elif asked.path == "/" and live.page is not None and live.frames:
                self._answer(200, live.page.text(live.key).encode(), "text/html; charset=utf-8")
            elif asked.path == "/":
                self._answer(BEGINS, b"begins, look again", "text/plain")
            elif asked.path == "/frames" and self._knows_the_key():
                after = parse_qs(asked.query).get("after", ["0"])[0]
                self._json(live.since(int(after) if after.isdigit() else 0))
            else:
                self._answer(404, b"nothing", "text/plain")

        def do_POST(self) -> None:
            """An order."""
            length = self.headers.get("Content-Length", "")
            if not (self._of_here() and self._knows_the_key() and self.path == "/order"):
                self._answer(403, b"not from here", "text/plain")
            elif not length.isdigit() or int(length) > MOST_BYTES:
                self._answer(400, b"too long", "text/plain")
            else:
                try:
                    body = json.loads(self.rfile.read(int(length)))
                except (ValueError, RecursionError):
                    body = None
                self._json(live.order(body))

        def _of_here(self) -> bool:
            """Whether the browser was sent here by this address, and not by a name that another
            page gave it.
            """
            return f"http://{self.headers.get('Host', '')}/" == live.address

        def _knows_the_key(self) -> bool:
            return secrets.compare_digest(self.headers.get("X-Testbed", ""), live.key)

        def _json(self, tree: Any) -> None:
            self._answer(200, json.dumps(tree).encode(), "application/json")

        def _answer(self, status: int, body: bytes, kind: str) -> None:
            self.send_response(status)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(body)))
            self.send_header("Cache-Control", "no-store")
            if status == BEGINS:
                self.send_header("Refresh", "1")
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_: Any) -> None:
            """Nothing on the console."""

    return Handler
