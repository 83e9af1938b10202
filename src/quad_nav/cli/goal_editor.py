"""Local web page in which goals are edited with the mouse and saved to their files.

The server listens on the loopback address alone, on a free port. Its address has a random part, and
it refuses requests of other hosts and origins: no other page in the same browser can use it.
"""

from __future__ import annotations

import json
import secrets
import sys
import threading
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Callable, Dict, List, Mapping, Tuple

from quad_nav.cli.options import echo, raise_on_signals
from quad_nav.errors import InputError
from quad_nav.files.output import output_faults
from quad_nav.files.values import is_number, is_whole
from quad_nav.mission.goal_file import MAX_BYTES, MAX_GOALS, parse_goals
from quad_nav.report.preview_page import page_data, preview_page, robot_data
from quad_nav.scenario.flight_setup import FlightOptions
from quad_nav.scenario.preview import MissionPreview
from quad_web.view.actions import GoalChange
from quad_web.view.goal_files import GoalFiles, version_of

_LOOPBACK = "127.0.0.1"
_PATIENCE_S = 10.0  # for the rest of a request
_POLICY = (
    "default-src 'none'; script-src 'nonce-{nonce}'; style-src 'unsafe-inline'; img-src data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


class GoalEditor:
    """The goal files of a mission, and what the page may do with them.

    Attributes:
        lock: Held while a request is served.
    """

    def __init__(self, options: FlightOptions, preview: MissionPreview, title: str) -> None:
        """Read the goal files.

        Raises:
            InputError: There are none, or one cannot be written.
        """
        self.lock = threading.Lock()
        self._options, self._preview, self._title = options, preview, title
        if not preview.files:
            raise InputError(
                ["--edit: this mission has no goal files; expected --goals FOLDER with some"]
            )
        numbers = [number for number in preview.numbers if number in preview.files]
        files = {number: preview.files[number] for number in numbers}
        faults = [
            fault for path in files.values() for fault in output_faults(path, "--edit", False)
        ]
        if not numbers:
            faults = list(preview.problems)
        if faults:
            raise InputError(faults)
        self._files = GoalFiles(files, lambda number: self._preview.check(number))

    def page(self, nonce: str) -> str:
        """Return the page with the files as they are now."""
        self._preview = MissionPreview(self._options)
        numbers = self._preview.numbers
        self._files.files = {
            number: self._preview.files[number]
            for number in numbers
            if number in self._preview.files
        }
        versions = {one.robot: one.version for one in self._files.goal_files() if not one.problem}
        robots = [self._preview.robot(number) for number in numbers]
        return preview_page(page_data(self._preview, robots, self._title, versions), nonce)

    def check(self, request: Any) -> Dict[str, Any]:
        """Check and plan a robot's edited goals.

        Args:
            request: ``{"robot": 0, "version": "...", "goals": [{"source", "x", "y", "yaw"}]}``.

        Returns:
            Faults of the goals' positions, plans and warnings; or ``problems`` of the request.
        """
        try:
            number, version, goals = _goals_of(request)
            content = self._files.edited(number, version, goals, places=False)
            sequence = parse_goals(content, str(self._preview.files[number]))
        except InputError as error:
            return {"problems": error.problems}
        data = robot_data(self._preview.robot(number, sequence))
        faults = [goal["fault"] for goal in data["goals"]]
        plans, warnings = data["plans"], data["warnings"]
        return {"problems": [], "faults": faults, "plans": plans, "warnings": warnings}

    def save(self, request: Any) -> Dict[str, Any]:
        """Check the edited goals of robots as ``quad fly`` does, and write their files.

        Args:
            request: ``{"robots": [...]}``, each as for ``check``.

        Returns:
            ``problems``, and nothing is written; or the files' new ``versions``, and the faults of
            the mission that ``remain``.
        """
        edited: Dict[int, bytes] = {}
        problems: List[str] = []
        robots = request.get("robots") if isinstance(request, Mapping) else None
        for one in robots if isinstance(robots, list) else []:
            try:
                number, version, goals = _goals_of(one)
                edited[number] = self._files.edited(number, version, goals)
            except InputError as error:
                problems += error.problems
        if not edited and not problems:
            problems = ["no goals to save; expected those of a robot"]
        if not problems:
            problems = self._write(edited)
        if problems:
            return {"problems": problems}
        self._preview = MissionPreview(self._options)
        versions = {number: version_of(content) for number, content in edited.items()}
        return {"problems": [], "versions": versions, "remaining": list(self._preview.problems)}

    def _write(self, edited: Mapping[int, bytes]) -> List[str]:
        for number, content in edited.items():
            try:
                self._files.write(number, content)
            except InputError as error:
                return error.problems
        return []


def _goals_of(request: Any) -> Tuple[int, str, List[GoalChange]]:
    """Return the robot, the version of its file and its goals in a request.

    Raises:
        InputError: It is not valid.
    """
    expected = InputError(['expected {"robot": 0, "version": "...", "goals": [...]}'])
    if not isinstance(request, Mapping) or not is_whole(request.get("robot")):
        raise expected
    goals = request.get("goals")
    if not isinstance(goals, list) or len(goals) > MAX_GOALS:
        raise expected
    edits: List[GoalChange] = []
    for goal in goals:
        if not isinstance(goal, Mapping):
            raise expected
        source, yaw_rad = goal.get("source"), goal.get("yaw")
        numbers = [goal.get("x"), goal.get("y"), *([] if yaw_rad is None else [yaw_rad])]
        if not all(map(is_number, numbers)) or not (source is None or is_whole(source)):
            raise expected
        edits.append(GoalChange(source, goal["x"], goal["y"], yaw_rad))
    return int(request["robot"]), str(request.get("version")), edits


class GoalServer(ThreadingHTTPServer):
    """Serves one editor on a free port of this machine.

    Attributes:
        editor: The editor.
        token: Random part of the address.
    """

    daemon_threads = True

    def __init__(self, editor: GoalEditor) -> None:
        """Listen."""
        super().__init__((_LOOPBACK, 0), _Handler)
        self.editor = editor
        self.token = secrets.token_urlsafe(24)

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{_LOOPBACK}:{self.server_port}/{self.token}/"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Report an error in a request, on standard error, and go on; a client may leave."""
        if isinstance(sys.exc_info()[1], ConnectionError):
            return
        echo("preview: a request of the page failed:", err=True)
        super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    server: GoalServer
    server_version, sys_version = "quad", ""
    timeout = _PATIENCE_S

    def do_GET(self) -> None:
        if self._is_refused(""):
            return
        nonce = secrets.token_urlsafe(16)
        try:
            with self.server.editor.lock:
                page = self.server.editor.page(nonce)
        except InputError as error:
            self._send(HTTPStatus.CONFLICT, "text/plain", str(error))
            return
        self._send(HTTPStatus.OK, "text/html", page, _POLICY.format(nonce=nonce))

    def do_POST(self) -> None:
        editor = self.server.editor
        actions: Dict[str, Callable[[Any], Dict[str, Any]]] = {
            "check": editor.check,
            "save": editor.save,
        }
        name = self.path.rsplit("/", 1)[-1]
        if self._is_refused(name if name in actions else "check") or not self._is_json():
            return
        try:
            request = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        except (ValueError, RecursionError):
            self._send(HTTPStatus.BAD_REQUEST, "text/plain", "the body is not JSON")
            return
        with editor.lock:
            answer = actions[name](request)
        self._send(HTTPStatus.OK, "application/json", json.dumps(answer))

    def _is_refused(self, name: str) -> bool:
        """Refuse other hosts, other origins and other paths than ``name``; True if refused."""
        host = f"{_LOOPBACK}:{self.server.server_port}"
        origin = self.headers.get("Origin")
        own = origin == f"http://{host}" or (origin is None and self.command == "GET")
        if self.headers.get("Host") != host or not own:
            self._send(HTTPStatus.FORBIDDEN, "text/plain", f"expected a request of http://{host}")
            return True
        path = f"/{self.server.token}/{name}"
        if not secrets.compare_digest(self.path.encode(), path.encode()):
            self._send(HTTPStatus.NOT_FOUND, "text/plain", "no such page")
            return True
        return False

    def _is_json(self) -> bool:
        """Refuse a body that is no JSON of a sensible size; True if it may be read."""
        length = self.headers.get("Content-Length", "")
        is_short = length.isdecimal() and len(length) < 10 and int(length) <= MAX_BYTES
        if self.headers.get("Content-Type") == "application/json" and is_short:
            return True
        self._send(HTTPStatus.BAD_REQUEST, "text/plain", "expected a JSON body")
        return False

    def _send(self, status: HTTPStatus, kind: str, body: str, policy: str = "") -> None:
        content = body.encode("utf-8")
        self.send_response(status)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Content-Security-Policy", policy or "default-src 'none'")
        self.send_header("Cache-Control", "no-store")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing: the address is a secret."""


def serve(editor: GoalEditor, show: Callable[[str], None]) -> None:
    """Serve the page until Ctrl-C or SIGTERM.

    Args:
        editor: The editor.
        show: Called with the address of the page.
    """
    raise_on_signals()
    with GoalServer(editor) as server:
        try:
            echo(f"preview: edit the goals at {server.url} (Ctrl-C ends it)")
            show(server.url)
            server.serve_forever()
        except KeyboardInterrupt:
            with editor.lock:  # a file that is being saved is saved
                echo("preview: ended")
