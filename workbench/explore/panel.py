"""The explorer's panel: sliders, buttons and tables around a `Session`, in Jupyter.

    slider --observe--> Session.set --> picture, tables.   Keyboard: Tab to a slider, arrow keys move it.

Gains move by ±100 % around the value they had when the panel was opened (or re-centred), time constants by a factor of
ten; a number typed beside a slider may be any that the law takes.

A slider shows the design, it does not hold it: whatever value the panel puts on it, the page answers with that value
rounded to the slider's step. Such an echo is no move, so the design keeps its digits and `undo` its steps.
"""

from asyncio import TimerHandle, get_running_loop
from collections.abc import Callable, Mapping
from html import escape
from math import floor, log10
from pathlib import Path

from workbench.control.gains import Gains
from workbench.design.problem import Problem
from workbench.errors import InfeasibleError, InputError
from workbench.explore.picture import Picture
from workbench.explore.plant import PlantPicture, PlantSession
from workbench.explore.session import Session
from workbench.handover.report.style import first_blocks, table_block
from workbench.result import figure

ECHO = 1e-7  # of a slider's range: the page computes its steps in per cent of it, to seven decimals
STEPS = 60  # of a slider between two bounds
SMALL = 0.1  # half range of a slider whose gain is zero
REST = 0.3  # [s] without a move, after which margins and failures are computed anew
STALE = "<style>.wb-explore .figures{opacity:.35}</style>"  # until then those shown are of another position
STYLE = (
    "<style>.wb-explore .figures{display:grid;gap:0 2rem;"
    "grid-template-columns:repeat(auto-fit,minmax(min(100%,24rem),1fr))}"
    ".wb-explore .wide{overflow-x:auto}.wb-explore .missed{color:#b0281f}"
    ".wb-explore h3{font-size:13px;margin:6px 0 0}.wb-explore .figures p{font-size:12px;margin:0}"
    ".wb-explore table{font-size:12px;line-height:1.25}"
    ".wb-explore td,.wb-explore th{padding:1px 6px;text-align:right}"
    ".wb-explore th:first-child{text-align:left;font-weight:normal}</style>"
)


class Explorer:
    """The panel. `explorer.session` holds gains and pins; displaying the explorer shows the panel.

    Parameters
    ----------
    problem : Problem
    gains : Gains, or mapping of parameter to value for a plant of one's own, optional
        The problem's approved ones if left out, or else the structure's own.
    state : path, optional
        A file that keeps gains, operating point and pins; read if it exists, written after every change.
    """

    def __init__(
        self, problem: Problem, gains: Gains | Mapping[str, float] | None = None, *, state: Path | str | None = None
    ) -> None:
        import ipywidgets as w

        self.session, self._picture = _session(problem, gains)
        self._state = None if state is None else Path(state)
        if self._state is not None and self._state.exists():
            self.session.load(self._state)
        self._quiet = False
        self.sliders = {name: self._slider(w, name) for names in self.session.groups.values() for name in names}
        self.image = w.Image(format="png", layout=w.Layout(width="100%", max_width="960px"))
        self.verdict, self.table, self.smallest, self.first = w.HTML(), w.HTML(), w.HTML(), w.HTML()
        self._resting: TimerHandle | None = None
        self.name = w.Text(placeholder="name of the design", layout=w.Layout(width="13em"))
        self.behind = w.Dropdown(options=["–"], description="behind", layout=w.Layout(width="15em"))
        self.file = w.Text(value="gains.json", description="file", layout=w.Layout(width="18em"))
        actions: dict[str, tuple[str, Callable[[], str | None]]] = {
            "optimise from here": ("Best gains near these, at this operating point", self.session.optimise),
            "pin this design": ("Keep it for comparison", self._pin),
            "unpin": ("Forget the design named", self._unpin),
            "undo": ("Back to the gains before", self.session.undo),
            "approved gains": ("Back to where the exploration began", self.session.restart),
            "export table": ("Write the gain table of this design", self._export),
        }
        self.buttons = {}
        for label, (tip, action) in actions.items():
            self.buttons[label] = w.Button(description=label, tooltip=tip, layout=w.Layout(width="auto"))
            self.buttons[label].on_click(lambda _, act=action: self._do(act))
        self.behind.observe(lambda _: self._show(), "value")
        titles = list(self.session.groups)
        boxes = [w.VBox([self.sliders[name] for name in names]) for names in self.session.groups.values()]
        accordion = w.Accordion(children=boxes, titles=titles, selected_index=0, layout=w.Layout(width="370px"))
        b = self.buttons
        self.panel = w.VBox(
            [
                w.HTML(STYLE),
                self.verdict,
                self.smallest,
                w.HBox([accordion, w.VBox([self.image], layout=w.Layout(flex="1"))]),
                w.HBox([b["optimise from here"], b["undo"], b["approved gains"], self.name, b["pin this design"],
                        b["unpin"], self.behind, self.file, b["export table"]], layout=w.Layout(flex_flow="row wrap")),
                self.first,
                self.table,
            ]
        )  # fmt: skip
        self.panel.add_class("wb-explore")
        self.table.add_class("wb-compare")
        self._list_pins()
        self._show()

    def _repr_mimebundle_(self, **options):
        return self.panel._repr_mimebundle_(**options)

    def _slider(self, w, name: str):
        session = self.session
        value, unit, interval = session.held(name), session.unit(name), session.interval(name)
        shown = {"description": name, "continuous_update": True, "readout_format": ".4g"}
        shown |= {"layout": w.Layout(width="340px"), "tooltip": f"{name} [{unit}]"}
        if interval is not None:
            low, high = interval
            slider = w.FloatSlider(value=value, min=low, max=high, step=(high - low) / STEPS, **shown)
        elif session.logarithmic(name):
            low, high = _decade(value)
            slider = w.FloatLogSlider(value=value, base=10, min=low, max=high, step=0.01, **shown)
        else:
            half = abs(value) or SMALL
            slider = w.FloatSlider(value=value, min=value - half, max=value + half, step=half / 100, **shown)
        slider.observe(lambda change: self._moved(name, change["new"]), "value")
        return slider

    def _moved(self, name: str, value: float) -> None:
        if self._quiet or self._is_echo(name, value):
            return
        self._do(lambda: self.session.move(name, float(value)), place=False)

    def _is_echo(self, name: str, value: float) -> bool:
        """Whether a slider's value is that of the session, as the page rounds it to the slider's step."""
        slider, held = self.sliders[name], self.session.held(name)
        low, high, step = float(slider.min), float(slider.max), float(slider.step or 0.0)
        if hasattr(slider, "base"):
            if not (held > 0 and value > 0):
                return False
            held, value = log10(held), log10(value)
        rounded = low + step * floor((held - low) / step + 0.5)
        return min(abs(value - rounded), abs(value - held)) <= ECHO * max(high - low, step)

    def _do(self, action: Callable[[], str | None], place: bool = True) -> None:
        """An action with its answer in words; a refusal is shown, not raised."""
        try:
            said = action()
        except (InputError, InfeasibleError) as error:
            self._show(f'<span style="color:#b0281f">{escape(str(error))}</span>')
            return
        if place:
            self._place()
        if self._state is not None:
            self.session.save(self._state)
        self._show(escape(said or ""))

    def _place(self) -> None:
        """Puts the sliders where the session is."""
        self._quiet = True
        for name, slider in self.sliders.items():
            value = self.session.held(name)
            if hasattr(slider, "base") and value > 0:
                low, high = _decade(value)
                slider.min, slider.max = min(slider.min, low), max(slider.max, high)
            else:
                slider.min, slider.max = min(slider.min, value), max(slider.max, value)
            slider.value = value
        self._quiet = False
        self._list_pins()

    def _list_pins(self) -> None:
        chosen = self.behind.value
        self.behind.options = ["–", *self.session.pins]
        self.behind.value = chosen if chosen in self.behind.options else "–"

    def _show(self, said: str = "") -> None:
        """Shows the present position: at once what a move must show, and the rest when the sliders have come to rest.

        Without an event loop, as in a script, `settle` is to be called.
        """
        self._draw(said)
        if self.first.value and not self.first.value.startswith(STALE):
            self.first.value, self.smallest.value = STALE + self.first.value, "…"
        if self._resting is not None:
            self._resting.cancel()
        try:
            self._resting = get_running_loop().call_later(REST, self.settle)
        except RuntimeError:  # nobody runs a loop
            self._resting = None

    def settle(self) -> None:
        """Shows verdicts on reserves, and the margins and failures of the present position."""
        try:
            rows, tables = self.session.settle()
        except (InputError, InfeasibleError) as error:
            self.smallest.value = escape(str(error))
            return
        self.first.value = first_blocks(tables)
        self.smallest.value = escape(" · ".join(f"{name} {figure(value)}" for name, value, _ in rows))
        self._draw("")

    def _draw(self, said: str) -> None:
        shot = self.session.snapshot
        pinned = self.session.pins.get(self.behind.value)
        self.image.value = self._picture.png(shot, None if pinned is None else pinned.shot)
        word, colour = ("all requirements met", "#2b7a4b") if shot.met else ("not every requirement met", "#b0281f")
        if not shot.stable:
            word = "unstable"
        elif shot.met and not shot.complete:
            word = "met as far as the nominal loop goes; reserves follow"
        title = escape(self.session.problem.title or self.session.problem.name)
        self.verdict.value = f"<b>{title}</b> · <b style='color:{colour}'>{word}</b> {said}"
        heads, rows = self.session.comparison()
        self.table.value = table_block(heads, rows)

    def _pin(self) -> str:
        return f"pinned as {self.session.pin(self.name.value).name}"

    def _unpin(self) -> None:
        self.session.unpin(self.name.value)

    def _export(self) -> str:
        return f"wrote {self.session.write_table(self.file.value)}"


def _session(problem: Problem, gains: Gains | Mapping[str, float] | None):
    """The session of a vehicle or of a plant of one's own, and what draws it."""
    if not problem.flies:
        return PlantSession(problem, gains.as_dict() if isinstance(gains, Gains) else gains), PlantPicture()
    return Session(problem, Gains.from_mapping(gains) if isinstance(gains, Mapping) else gains), Picture()


def _decade(value: float) -> tuple[float, float]:
    """Exponents half a decade below and above a time constant."""
    return log10(value) - 0.5, log10(value) + 0.5
