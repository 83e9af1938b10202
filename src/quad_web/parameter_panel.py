"""Parameters of the selected robot's navigator: search, change, and go back to the files.

``data-testid``: ``parameters``, ``parameters-search``, ``parameters-changed``; for each namespace
``namespace-<namespace>`` and ``reset-<namespace>``; for each parameter ``p-<namespace>/<name>``
with ``value-...`` (its control), ``number-...`` (beside a slider) and ``reset-...``.
"""

from __future__ import annotations

import math
from typing import Any, Callable, Dict, Iterable, List, Optional, Sequence, Tuple

from nicegui import ui

from quad_nav.errors import excerpt
from quad_web.flight_bar import enable
from quad_web.page_client import PageClient
from quad_web.robot_panels import typed_number
from quad_web.view.actions import Answer, ParameterView

_WIDEST = 1e6  # a wider range is none: dynamic_reconfigure writes its largest double for "no limit"
_STEPS = 200

Key = Tuple[str, str]


def widget_kind(parameter: ParameterView) -> str:
    """Return the control of a parameter: "switch", "select", "slider", "number" or "text"."""
    if parameter.choices:
        return "select"
    if parameter.kind == "bool":
        return "switch"
    if parameter.kind not in ("int", "double"):
        return "text"
    low, high = parameter.minimum, parameter.maximum
    is_range = low is not None and high is not None and 0.0 < high - low <= _WIDEST
    return "slider" if is_range else "number"


def slider_range(parameter: ParameterView) -> Tuple[float, float]:
    """Return the ends of a slider: the range, but not far beyond the size of the values.

    The values in force and of the file lie below half of it. A number may be typed beyond.
    """
    low, high = float(parameter.minimum or 0.0), float(parameter.maximum or 0.0)
    size = max(abs(float(value or 0.0)) for value in (parameter.value, parameter.file_value))
    if size > 0.0:
        reach = round_up(2.0 * size)
        low, high = max(low, min(-reach, high)), min(high, max(reach, low))
    return low, high


def slider_step(low: float, high: float, kind: str) -> float:
    """Return a round step, about 200 of them, whole ones of an "int"."""
    step = round_up((high - low) / _STEPS)
    return max(1.0, round(step)) if kind == "int" else step


def round_up(number: float) -> float:
    """Return the next 1, 2 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(number))
    return next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= number * (1.0 - 1e-9))


def is_found(parameter: ParameterView, text: str) -> bool:
    """Return whether all words of a text are in the parameter's name, namespace or doc."""
    where = f"{parameter.namespace}/{parameter.name} {parameter.doc}".lower()
    return all(word in where for word in text.lower().split())


def is_changed(parameter: ParameterView) -> bool:
    """Return whether a value differs from the one that was loaded."""
    return bool(parameter.value != parameter.file_value)


def value_text(value: Any) -> str:
    """Return a value for people."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:.6g}" if isinstance(value, float) else excerpt(str(value))


def by_namespace(parameters: Iterable[ParameterView]) -> Dict[str, List[ParameterView]]:
    """Return parameters by their namespace, in their order."""
    grouped: Dict[str, List[ParameterView]] = {}
    for parameter in parameters:
        grouped.setdefault(parameter.namespace, []).append(parameter)
    return grouped


class ParameterRow:
    """One parameter: name, doc, control, and the way back to its file."""

    def __init__(
        self,
        parameter: ParameterView,
        client: PageClient,
        change: Callable[[ParameterView, Any], Any],
    ) -> None:
        self.parameter = parameter
        self._change = change
        self._inputs: List[Any] = []
        self._is_sending = False
        name = f"{parameter.namespace}/{parameter.name}"
        with ui.element("div").classes("parameter") as self.element:
            self.element.props["data-testid"] = f"p-{name}"
            with ui.element("div").classes("parameter-head"):
                ui.label(excerpt(parameter.name)).classes("parameter-name")
                self._file = ui.label().classes("muted")
                self._reset = ui.button(icon="undo", on_click=self._go_back)
                self._reset.props("flat dense round size=xs")
                self._reset.props.update(
                    {"data-testid": f"reset-{name}", "title": "Back to the file's value"}
                )
            with ui.element("div").classes("parameter-value"):
                self._make_input(name)
            if parameter.doc:
                ui.label(excerpt(parameter.doc, 400)).classes("doc")
        for element in (*self._inputs, self._reset):
            enable(element, client, "set_parameters")
        self.show(parameter)

    def _make_input(self, name: str) -> None:
        parameter, kind = self.parameter, widget_kind(self.parameter)
        if kind == "switch":
            first: Any = ui.switch(value=bool(parameter.value)).props("dense")
            first.on("update:model-value", lambda: self._set(bool(first.value)))
        elif kind == "select":
            options = {
                value: label if label == value else f"{label} ({value})"
                for label, value in parameter.choices
            }
            options.setdefault(parameter.value, value_text(parameter.value))
            first = ui.select(options, value=parameter.value).props("dense outlined options-dense")
            first.on("update:model-value", lambda: self._set(first.value))
        elif kind == "slider":
            low, high = slider_range(parameter)
            step = slider_step(low, high, parameter.kind)
            first = ui.slider(min=low, max=high, step=step, value=low)
            first.props("dense").on("change", lambda: self._set_number(first.value))
        else:
            first = self._field()
        self._inputs.append(first)
        first.props["data-testid"] = f"value-{name}"
        first.props["aria-label"] = parameter.name
        if kind == "slider":
            self._inputs.append(self._field())
            self._inputs[-1].props["data-testid"] = f"number-{name}"
            self._inputs[-1].props["aria-label"] = f"{parameter.name}, number"

    def _field(self) -> Any:
        field = ui.input(value=value_text(self.parameter.value)).props("dense outlined")
        field.on("keydown.enter", lambda: self._set_typed(field))
        field.on("blur", lambda: self._set_typed(field))
        return field

    def show(self, parameter: ParameterView) -> None:
        """Show a value that is in force."""
        is_new = parameter.value != self.parameter.value or not self._file.text
        self.parameter = parameter
        if not is_new:
            return
        changed = is_changed(parameter)
        self.element.classes(add="changed") if changed else self.element.classes(remove="changed")
        self._file.text = f"file: {value_text(parameter.file_value)}"
        self._reset.set_visibility(changed)
        self.put_back()

    def put_back(self) -> None:
        """Put the value in force into the control, as after a refusal."""
        for element in self._inputs:
            is_typed = isinstance(element, ui.input)
            if isinstance(element, ui.slider):
                low, high = slider_range(self.parameter)
                step = slider_step(low, high, self.parameter.kind)
                element.props.update(min=low, max=high, step=step)
            element.value = value_text(self.parameter.value) if is_typed else self.parameter.value

    async def _set(self, value: Any) -> None:
        if value == self.parameter.value:
            self.put_back()
            return
        self._is_sending = True
        try:
            await self._change(self.parameter, value)
        finally:
            self._is_sending = False

    async def _set_number(self, value: Any) -> None:
        await self._set(round(value) if self.parameter.kind == "int" else float(value))

    async def _set_typed(self, field: Any) -> None:
        if self._is_sending or field.value == value_text(self.parameter.value):
            return  # Enter sends, and the loss of focus afterwards does not send again
        value: Any = str(field.value)
        if self.parameter.kind in ("int", "double"):
            value = typed_number(field.value)
            if isinstance(value, float) and self.parameter.kind == "int" and value.is_integer():
                value = int(value)
        await self._set(value)

    async def _go_back(self) -> None:
        await self._change(self.parameter, self.parameter.file_value)


class Parameters:
    """All parameters of the selected robot, by namespace."""

    def __init__(self, client: PageClient) -> None:
        self._client = client
        self._rows: Dict[Key, ParameterRow] = {}
        self._robot: Optional[int] = None
        self._parameters: List[ParameterView] = []
        self._layout: Any = None
        self._is_busy = False
        self._open = {""}
        with ui.element("div").classes("filters"):
            self._search = ui.input(placeholder="search", on_change=lambda: self._lay_out())
            self._search.props(
                "dense outlined clearable debounce=250 data-testid=parameters-search"
            )
            self._only = ui.checkbox("changed only", on_change=lambda: self._lay_out())
            self._only.props("dense data-testid=parameters-changed")
        self._note = ui.label().classes("note")
        self._body = ui.element("div").classes("scroll").props("data-testid=parameters")
        self._note.text = "Select a robot to see its parameters."

    async def refresh(self) -> None:
        """Read the selected robot's parameters, and show what has changed."""
        robot = self._client.selected
        if self._is_busy:
            return
        self._is_busy = True
        if robot is not None and robot != self._robot:
            self._note.text = f"Reading the parameters of {self._client.name(robot)} ..."
        try:
            found = [] if robot is None else list(await self._client.read("parameters", robot))
        finally:
            self._is_busy = False
        if robot == self._client.selected:
            self._show(robot, found)

    def _show(self, robot: Optional[int], found: List[ParameterView]) -> None:
        before = [(one.namespace, one.name) for one in self._parameters]
        is_other = robot != self._robot or before != [(one.namespace, one.name) for one in found]
        self._robot, self._parameters = robot, found
        if robot is None:
            self._note.text = "Select a robot to see its parameters."
        elif not found:
            self._note.text = f"{self._client.name(robot)} has no parameters that can be changed."
        self._lay_out(is_other)
        for parameter in found:
            row = self._rows.get((parameter.namespace, parameter.name))
            if row is not None:
                row.show(parameter)

    def _lay_out(self, is_other: bool = False) -> None:
        """Make the rows of open namespaces, or of all that are sought."""
        text = str(self._search.value or "")
        is_sought = bool(text.strip() or self._only.value)
        shown = [
            one
            for one in self._parameters
            if is_found(one, text) and (is_changed(one) or not self._only.value)
        ]
        if self._parameters:
            count, name = len(self._parameters), self._client.name(self._robot)
            changed = sum(map(is_changed, self._parameters))
            text = f"{len(shown)} of {count} shown" if is_sought else f"{count} parameters"
            self._note.text = f"{name}: {text}" + (f", {changed} changed" if changed else "")
        layout = (is_sought, [(one.namespace, one.name) for one in shown])
        if layout == self._layout and not is_other:
            return
        self._layout = layout
        self._rows.clear()
        self._body.clear()
        with self._body:
            for namespace, parameters in by_namespace(shown).items():
                self._make_namespace(namespace, parameters, is_sought)

    def _make_namespace(
        self, namespace: str, parameters: Sequence[ParameterView], is_sought: bool
    ) -> None:
        is_open = is_sought or namespace in self._open
        group = ui.expansion(excerpt(namespace) or "move_base", value=is_open).classes("namespace")
        group.props("dense dense-toggle").props["data-testid"] = f"namespace-{namespace}"
        is_made: List[bool] = []

        def make() -> None:
            if is_made:
                return
            is_made.append(True)
            with group:
                back = ui.button("All back to the file", icon="undo")
                back.props("flat dense no-caps size=sm").classes("namespace-reset")
                back.props["data-testid"] = f"reset-{namespace}"
                back.on_click(lambda: self._reset(namespace))
                enable(back, self._client, "set_parameters")
                for one in parameters:
                    row = ParameterRow(one, self._client, self._change)
                    self._rows[one.namespace, one.name] = row

        def toggled() -> None:
            if group.value:
                self._open.add(namespace)
                make()
            else:
                self._open.discard(namespace)

        group.on_value_change(toggled)
        if is_open:
            make()

    async def _change(self, parameter: ParameterView, value: Any) -> None:
        await self._set(parameter.namespace, {parameter.name: value})

    async def _reset(self, namespace: str) -> None:
        values = {
            one.name: one.file_value
            for one in self._parameters
            if one.namespace == namespace and is_changed(one)
        }
        if values:
            await self._set(namespace, values)
        else:
            self._client.show(Answer(True, f"{namespace or 'move_base'}: as in the file"))

    async def _set(self, namespace: str, values: Dict[str, Any]) -> None:
        robot = self._robot
        if robot is None:
            return
        answer = await self._client.call("set_parameters", robot, namespace, values, robot=robot)
        if not answer.ok:
            for name in values:
                row = self._rows.get((namespace, name))
                if row is not None:
                    row.put_back()
        await self.refresh()
