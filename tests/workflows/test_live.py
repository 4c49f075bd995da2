"""A run in the browser: what it is shown, what it may order, and that nobody else may order
anything.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
import shutil
import subprocess
import threading
import time
from collections.abc import Iterator
from html import unescape
from types import SimpleNamespace
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import numpy as np
import pytest
from shipped import MACHINE
from synthetic_run import synthetic_columns

import testbed
from testbed.machine.names import LEGS
from testbed.robot.robot import Robot
from testbed.scenario.scenario import load_scenario
from testbed.workflows.live import Live

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")


class Rows:
    """Stands for a run: the rows of a made-up one, one after the other, and what was ordered of
    it.
    """

    def __init__(self) -> None:
        self._data, self._truth = synthetic_columns(1.0)
        for leg in LEGS:
            self._data[f"estimate_own_{leg}"] = self._truth[f"foot_load_{leg}"]
        self.row, self.events, self.ordered = 0, [], []

    robot = Robot.of(MACHINE)

    @property
    def t_s(self) -> float:
        return 0.0  # no waiting for the clock

    def now(self) -> Any:
        self.row += 1
        return tuple(
            {n: c[self.row : self.row + 1] for n, c in part.items()}
            for part in (self._data, self._truth)
        )

    def happen(self, kind: str, **fields: Any) -> None:
        self.ordered.append((kind, fields))
        self.events.append({"t": 0.5, "kind": kind})


@pytest.fixture
def live() -> Iterator[SimpleNamespace]:
    rows = Rows()
    with Live(load_scenario("stand_slope_45")) as page:
        yield SimpleNamespace(page=page, rows=rows, look=lambda: page.look(rows))


def asked(live: SimpleNamespace, path: str, body: Any = None, key: str | None = None) -> Any:
    headers = {"X-Testbed": live.page.key if key is None else key}
    data = None if body is None else json.dumps(body).encode()
    with urlopen(Request(live.page.address + path, data, headers), timeout=5) as answer:
        return json.loads(answer.read())


def test_the_page_gets_every_frame_once_and_the_loads_of_the_last(live: SimpleNamespace) -> None:
    for _ in range(5):
        assert live.look()
    now = asked(live, "frames?after=2")
    assert len(now["frames"]) == 3 and all(len(frame) == 42 for frame in now["frames"])
    truth = live.rows._truth
    assert now["cells"]["true_rr"] == f"{truth['foot_load_rr'][live.rows.row]:.0f}"
    assert now["state"] == "running"


def test_orders_reach_the_run_at_its_next_look(live: SimpleNamespace) -> None:
    live.look()
    push = {"kind": "shove", "at": "fl", "force_in_world_n": [0, 3000, 0], "duration_s": 0.3}
    assert asked(live, "order", push) == {"done": "shove"}
    assert asked(live, "order", {"kind": "cut_rope", "rope": "left"}) == {"done": "cut rope"}
    live.look()
    shove = {"duration_s": 0.3, "force_in_world_n": (0, 3000, 0), "at": "fl"}
    assert live.rows.ordered == [("shove", shove), ("cut_rope", {"rope": "left"})]
    assert asked(live, "frames?after=0")["events"][-1].endswith("cut rope")


def test_a_pause_holds_the_run_until_it_goes_on(live: SimpleNamespace) -> None:
    live.look()
    assert asked(live, "order", {"kind": "pause"}) == {"done": "paused"}
    assert not live.look() and live.rows.row == 1
    assert asked(live, "order", {"kind": "pause"}) == {"done": "running"}
    assert live.look() and live.rows.row == 2


@pytest.mark.parametrize(
    "body",
    [
        {"kind": "payload", "mass_kg": 5},
        {"kind": "cut_rope", "rope": "middle"},
        {"kind": "set_friction", "friction": -1},
        [],
        "x",
    ],
)
def test_what_is_no_order_is_refused_in_a_line(live: SimpleNamespace, body: Any) -> None:
    live.look()
    assert "refused" in asked(live, "order", body)
    live.look()
    assert live.rows.ordered == []


@pytest.mark.parametrize("path", ["frames?after=0", "order"])
def test_another_page_without_the_key_learns_and_orders_nothing(
    live: SimpleNamespace, path: str
) -> None:
    live.look()
    with pytest.raises(HTTPError):
        asked(live, path, {"kind": "pause"} if path == "order" else None, key="guess")
    request = Request(live.page.address, headers={"Host": "elsewhere.example"})
    with pytest.raises(HTTPError, match="403"):
        urlopen(request, timeout=5)
    assert live.page.state == "running"


def test_the_page_runs_its_own_scripts_alone(live: SimpleNamespace) -> None:
    live.look()
    with urlopen(live.page.address, timeout=5) as answer:
        text = answer.read().decode()
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', text)[1]
    assert "connect-src &#39;self&#39;" in policy and policy.count("sha256-") == 2
    for script in re.findall(r"<script>(.*?)</script>", text, re.DOTALL):
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
        assert digest in unescape(policy)
    assert not re.search(r"<[^>]+ on\w+=", text)


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="no browser is at hand")
def test_a_browser_shows_it(live: SimpleNamespace) -> None:
    live.look()
    over = threading.Event()

    def go_on() -> None:
        while not over.is_set():
            live.look()
            time.sleep(0.02)

    thread = threading.Thread(target=go_on)
    thread.start()
    command = [
        BROWSER,
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--virtual-time-budget=3000",
        "--dump-dom",
        live.page.address,
    ]
    dom = subprocess.run(command, capture_output=True, text=True, timeout=120).stdout
    over.set()
    thread.join()
    assert "running" in dom and 'id="true_fl">–' not in dom
    assert 'id="true_fl">' in dom


@pytest.mark.slow
def test_ground_that_turns_slippery_holds_as_much_as_its_friction_says() -> None:
    changes = ["events=[{kind: set_friction, at_s: 0.3, friction: 0.1}]"]
    scenario = testbed.load_scenario("stand_slope_45", changes, duration=0.6)
    with testbed.simulate(scenario) as run:
        while not run.finished:
            run.step(100)
        t, force = run.truth["t"], run.truth["foot_force_in_world"]
        normal = run.truth["contact_normal"]
    tangential = np.sqrt(np.maximum((force**2).sum(axis=2) - normal**2, 0.0))
    use = tangential / np.maximum(normal, 1.0)
    assert use[(t > 0.2) & (t < 0.29)].max() > 0.15
    assert use[t > 0.4].max() < 0.11
