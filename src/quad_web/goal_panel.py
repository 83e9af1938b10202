"""Editor of a robot's goal file: a list of goals, and goals that are dragged in the arena.

``data-testid``: ``goals-robot``, ``goals-file``, ``goals-edit``, ``goals-add``, ``goals-save``,
``goals-discard``, ``goals-status``, ``goals-notice``, ``goals-reload``, ``goals-pages``; for each
goal, from 0, ``g-<index>`` with ``g-x-...``, ``g-y-...``, ``g-yaw-...``, ``g-up-...``,
``g-down-...``, ``g-delete-...`` and ``g-fault-...``.
"""

from __future__ import annotations

import math
from typing import Any, Callable, Dict, List, Optional, Sequence

from nicegui import background_tasks, ui

from quad_nav.errors import printable
from quad_web.flight_bar import enable
from quad_web.goal_draft import FIELDS, GoalDraft
from quad_web.page_client import PageClient
from quad_web.robot_panels import pose_of, typed_number
from quad_web.view.actions import Answer, GoalChange, GoalFileView

PAGE = 50
"""Goals in the list at a time."""
_STEP_M = 1.0  # from the last goal to one that is added with the button


class GoalEditor:
    """Edits, checks and saves one goal file at a time."""

    def __init__(
        self, client: PageClient, apply: Callable[..., None], set_tool: Callable[[str], None]
    ) -> None:
        """Make the panel; ``apply`` and ``set_tool`` are those of the arena."""
        self._client = client
        self._apply = apply
        self._set_tool = set_tool
        self.draft: Optional[GoalDraft] = None
        self._files: Dict[int, GoalFileView] = {}
        self._check_wanted = self._is_checking = False
        self._is_busy = self._is_editing = False
        self._rows: List[Dict[str, Any]] = []
        self._make_head()
        self._make_notice()
        self._list = ui.element("div").classes("scroll goals")
        self._pages = ui.pagination(1, 1, on_change=self._lay_out).props("data-testid=goals-pages")
        self._make_foot()
        client.on_select(self._selected)
        self._show()

    def _make_head(self) -> None:
        with ui.element("div").classes("filters"):
            self._robot = ui.select([], label="goals of", on_change=self._robot_chosen)
            self._robot.props("dense outlined options-dense data-testid=goals-robot")
            self._edit = ui.button("Edit in the arena", icon="edit_location_alt")
            self._edit.on_click(lambda: self._set_tool("view" if self._is_editing else "edit"))
            self._edit.props("outline dense no-caps data-testid=goals-edit")
            enable(self._edit, self._client, "save_goals")
        self._path = ui.label().classes("muted path").props("data-testid=goals-file")

    def _make_notice(self) -> None:
        with ui.element("div").classes("notice").props("data-testid=goals-notice") as self._notice:
            self._notice_text = ui.label()
            reload_it = ui.button("Load the file again", on_click=self._reload)
            reload_it.props("flat dense no-caps data-testid=goals-reload")
        self._notice.set_visibility(False)

    def _make_foot(self) -> None:
        self._status = ui.label().classes("note").props("data-testid=goals-status")
        with ui.element("div").classes("actions"):
            self._add = ui.button("Add goal", icon="add", on_click=self._add_goal)
            self._add.props("outline dense no-caps data-testid=goals-add")
            self._discard = ui.button("Discard", icon="undo", on_click=self._reload)
            self._discard.props("outline dense no-caps data-testid=goals-discard")
            self._save = ui.button("Save", icon="save", on_click=self.save)
            self._save.props("unelevated dense no-caps data-testid=goals-save")
            for button in (self._add, self._save):
                enable(button, self._client, "save_goals")

    # -- what it shows ---------------------------------------------------------------

    async def refresh(self) -> None:
        """Read the files, and show the one of the chosen robot if nothing is edited in it."""
        if self._is_busy:
            return
        self._is_busy = True
        try:
            files: Sequence[GoalFileView] = await self._client.read("goal_files")
        finally:
            self._is_busy = False
        self._files = {file.robot: file for file in files}
        names = {robot: self._client.name(robot) for robot in self._files}
        if names != self._robot.options:
            self._robot.set_options(names)
        chosen = self._robot.value
        if chosen is None and names:
            selected = self._client.selected
            chosen = self._robot.value = selected if selected in names else min(names)
        file = self._files.get(chosen) if chosen is not None else None
        draft = self.draft
        if file is None or draft is None or draft.file.robot != chosen:
            self._begin(file)
        elif file.version != draft.file.version and not draft.is_changed:
            self._begin(file)
        self._show()

    def _begin(self, file: Optional[GoalFileView]) -> None:
        self.draft = GoalDraft(file) if file is not None else None
        self._lay_out()
        self._changed()

    def _show(self) -> None:
        draft, file = self.draft, None
        if draft is None:
            self._path.text = "This source has no goal files."
        else:
            self._path.text = printable(draft.file.path)
            file = self._files.get(draft.file.robot)
        is_other = draft is not None and file is not None and file.version != draft.file.version
        problem = draft.file.problem if draft else ""
        if is_other:
            problem = "The file has changed on the disk since it was loaded here."
        self._notice_text.text = printable(problem)
        self._notice.set_visibility(bool(problem))
        self._status.text = self._status_text()
        is_changed = draft is not None and draft.is_changed
        can = not self._client.refusal("save_goals")
        faultless = draft is not None and not draft.fault_count
        self._save.set_enabled(can and is_changed and faultless and not problem)
        self._add.set_enabled(can and draft is not None and not draft.file.problem)
        self._discard.set_enabled(can and is_changed)
        self._edit.set_enabled(can and draft is not None and not draft.file.problem)
        for row, fault in zip(self._rows, self._shown_faults()):
            row["fault"].text = fault
            row["element"].classes(add="faulty" if fault else "", remove="" if fault else "faulty")

    def _status_text(self) -> str:
        if self.draft is None:
            return ""
        count, faults = len(self.draft.goals), self.draft.fault_count
        text = f"{count} goal{'s' * (count != 1)}"
        text += ", not saved" if self.draft.is_changed else ", as in the file"
        return f"{text}; {faults} with a fault" if faults else text

    @property
    def _first(self) -> int:
        return PAGE * (int(self._pages.value or 1) - 1)

    def _shown_faults(self) -> List[str]:
        return self.draft.faults[self._first : self._first + PAGE] if self.draft else []

    def _lay_out(self) -> None:
        """Make the rows of the goals on this page of the list."""
        goals = self.draft.goals if self.draft else []
        self._pages.max = max(1, math.ceil(len(goals) / PAGE))
        self._pages.set_visibility(len(goals) > PAGE)
        self._pages.value = min(self._pages.value or 1, self._pages.max)
        self._rows = []
        self._list.clear()
        with self._list:
            for index in range(self._first, min(self._first + PAGE, len(goals))):
                self._rows.append(self._make_row(index, goals[index]))

    def _make_row(self, index: int, goal: Dict[str, Any]) -> Dict[str, Any]:
        row: Dict[str, Any] = {}
        can_edit = not self._client.refusal("save_goals")
        with ui.element("div").classes("goal").props(f"data-testid=g-{index}") as row["element"]:
            ui.label(str(index + 1)).classes("goal-number")
            for name in FIELDS:
                field = ui.input(name, value=_typed(goal[name])).props("dense outlined")
                field.props(f"inputmode=decimal data-testid=g-{name}-{index}")
                field.set_enabled(can_edit)
                for event in ("blur", "keydown.enter"):
                    field.on(event, lambda name=name: self._typed(index, name))
                row[name] = field
            for name, icon, act in (
                ("up", "arrow_upward", lambda: self._edited("move", index, -1)),
                ("down", "arrow_downward", lambda: self._edited("move", index, 1)),
                ("delete", "delete", lambda: self._edited("delete", index)),
            ):
                button = ui.button(icon=icon, on_click=act).props("flat dense round size=sm")
                button.props(f"data-testid=g-{name}-{index} title={name} aria-label={name}")
                button.set_enabled(can_edit)
            row["fault"] = ui.label().classes("fault").props(f"data-testid=g-fault-{index}")
        return row

    # -- what it does ----------------------------------------------------------------

    def set_editing(self, is_editing: bool) -> None:
        """Begin or end the edit in the arena; the list works either way."""
        self._is_editing = is_editing
        self._edit.text = "End edit in the arena" if is_editing else "Edit in the arena"
        self._changed()

    def take(self, goals: Sequence[GoalChange]) -> None:
        """Take the goals that were dragged, added or deleted in the arena."""
        if self.draft is None or self._client.refusal("save_goals"):
            return
        before = len(self.draft.goals)
        self.draft.take(goals)
        if len(self.draft.goals) != before:
            self._lay_out()
        for row, goal in zip(self._rows, self.draft.goals[self._first :]):
            for name in FIELDS:
                row[name].value = _typed(goal[name])
        self._changed(is_drawn=True)

    async def save(self) -> None:
        """Save the file if its goals are good."""
        draft = self.draft
        changes = draft.changes() if draft else None
        if draft is None or changes is None:
            return
        robot, version = draft.file.robot, draft.file.version
        answer = await self._client.call("save_goals", robot, version, changes, robot=robot)
        if answer.ok:
            self.draft = None
        await self.refresh()

    async def _reload(self) -> None:
        self.draft = None
        await self.refresh()

    def _typed(self, index: int, name: str) -> None:
        if self.draft is None or index >= len(self.draft.goals):
            return
        text = self._rows[index - self._first][name].value
        if text != _typed(self.draft.goals[index][name]):
            self.draft.set(index, name, typed_number(text))
            self._changed()

    def _edited(self, method: str, *args: Any) -> None:
        if self.draft is not None and not self._client.refusal("save_goals"):
            getattr(self.draft, method)(*args)
            self._lay_out()
            self._changed()

    def _add_goal(self) -> None:
        """Add a goal a metre behind the last one, or at the robot."""
        if self.draft is None:
            return
        changes = self.draft.changes()
        here = pose_of(self._client.state, self.draft.file.robot)
        if changes:
            self._edited("add", round(changes[-1].x_m + _STEP_M, 3), changes[-1].y_m)
        elif here is not None:
            self._edited("add", round(here.x_m, 3), round(here.y_m, 3))
        else:
            self._edited("add", 0.0, 0.0)

    def _robot_chosen(self) -> None:
        chosen = self._robot.value
        if self.draft is None or chosen is None or chosen == self.draft.file.robot:
            return
        if self.draft.is_changed:
            name = self._client.name(self.draft.file.robot)
            self._client.show(Answer(False, f"{name}: save or discard its goals first"))
            self._robot.value = self.draft.file.robot
            return
        self._begin(self._files.get(chosen))

    def _selected(self, robot: Optional[int]) -> None:
        is_free = self.draft is None or not self.draft.is_changed
        if is_free and robot in self._files:
            self._robot.value = robot

    def _changed(self, is_drawn: bool = False) -> None:
        """Show an edit, and have its positions checked."""
        self._show()
        if not is_drawn:
            self._draw_it()
        self._check_wanted = True
        if not self._is_checking and self.draft is not None:
            self._is_checking = True
            background_tasks.create(self._check(), name="check goals")

    async def _check(self) -> None:
        try:
            while self._check_wanted and self.draft is not None:
                self._check_wanted = False
                draft, changes = self.draft, self.draft.valid_changes()
                file = draft.file
                faults = await self._client.read("check_goals", file.robot, file.version, changes)
                if draft is self.draft and not self._check_wanted:
                    draft.found(faults)
                    self._show()
                    self._draw_it()
        finally:
            self._is_checking = False

    def _draw_it(self) -> None:
        draft = self.draft
        if not self._is_editing or draft is None:
            self._apply(editing=None)
        elif draft.changes() is not None:
            goals, faults = [dict(goal) for goal in draft.goals], list(draft.faults)
            self._apply(editing={"robot": draft.file.robot, "goals": goals, "faults": faults})


def _typed(value: Any) -> str:
    """Return a value as it stands in a field."""
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)
