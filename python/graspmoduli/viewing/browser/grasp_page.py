"""The page of an object and its grasps."""

from __future__ import annotations

import io
import json
import threading
from collections.abc import Callable, Sequence
from html import escape
from pathlib import PurePath
from typing import Any, NamedTuple

import numpy as np

from ..._arrays import Floats
from ...objects.fitting import Fit, ObjectGrasp
from ...objects.reading import Object
from .. import words
from ..forms import DARK, finger_color, local
from ..held import Contact, Hand, Held, Touch, in_order
from ..improve import improved
from .cameras import Eye
from .colors import Colors
from .pulling import Pull
from .scene import BAD, draw_finger, draw_net, draw_object, draw_weakest
from .script import page_script

#: What the sliders offer of friction and edges; they reach farther where a command asks for more.
FRICTIONS, EDGES = (0.1, 2.0), (3, 32)
#: So far a key moves a finger, over the object's size.
STEP = 0.01
#: Keys that move a finger: to the right and up, as seen.
KEYS = {"J": (-1.0, 0.0), "L": (1.0, 0.0), "I": (0.0, 1.0), "K": (0.0, -1.0)}


class Shown(NamedTuple):
    """What a page is about."""

    thing: Object
    fit: Fit
    grasps: Sequence[ObjectGrasp]
    hand: Hand
    name: str
    #: How many fingers there are if no grasp is.
    fingers: int = 3
    #: In the object's unit; the defaults of :class:`Touch` if not given.
    tip_radius: float | None = None
    center_of_mass: Floats | None = None
    #: What is saved of grasps, as ``grasp --json`` writes it.
    report: Callable[[list[ObjectGrasp], Hand], dict[str, Any]] | None = None


#: Height of viser's picture [rad], and a shape that most windows have beside the panel.
FOV, ASPECT = 1.31, 1.2


def first_look(shown: Shown) -> tuple[Any, Any]:
    """Eye of the best view of the first grasp, and what it looks at."""
    contacts = local(shown.fit, shown.grasps[0].contacts)
    normals = shown.grasps[0].normals @ shown.fit.pose[:3, :3]
    eye, target, _ = Eye(None, shown.fit, shown.thing).view(contacts, normals, [], ASPECT, FOV)
    return tuple(eye.tolist()), tuple(target.tolist())


class GraspPage:
    """An object, its fit and a grasp to play with, in one browser."""

    def __init__(self, client: Any, shown: Shown) -> None:
        self.client, self.shown, self.fit, self.grasps = client, shown, shown.fit, shown.grasps
        center = self.grasps[0].center_of_mass if self.grasps else shown.center_of_mass
        self.touch = Touch(shown.fit, shown.tip_radius, center)
        self.surface = (1.0 / self.fit.length_scale) * self.fit.surface
        self.lock = threading.RLock()
        if self.grasps:
            self.held = self.touch.held(self.grasps[0])
        else:
            self.held = self.touch.around(shown.fingers)
        #: The grasp on offer that this one came from, from 0; what it was before, last first.
        self.rank_shown = 0
        self.past: list[Held] = []
        self.qualities: list[float] = []
        self.chosen = 0
        #: Points of the weakest push and twist.
        self.arrows: list[Floats] = []
        scene = client.scene
        self.object = draw_object(scene, shown.thing, self.fit)
        self.net = draw_net(scene, self.surface)
        self.eye = Eye(client, self.fit, shown.thing)
        self._panel()
        self.balls: list[Any] = []
        self.cages: list[Any] = []
        for index in range(len(self.held.fingers)):
            color = finger_color(index)
            ball = scene.add_icosphere(f"/ball {index + 1}", 0.05, color, subdivisions=3)
            ball.on_drag(self._dragger(index))
            self.balls.append(ball)
            self.cages.append(
                scene.add_box(
                    f"/cage {index + 1}", BAD, dimensions=(0.15, 0.15, 0.15), wireframe=True,
                    visible=False,
                )
            )  # fmt: skip
        self._keys()
        self.show(self.held)
        self.home(ease=False)
        self.aspect = float(client.camera.aspect)
        client.camera.on_update(lambda _: self._reshaped())

    # The panel ----------------------------------------------------------------------------------

    def _panel(self) -> None:
        gui, shown = self.client.gui, self.shown
        count = max(len(self.grasps), 1)
        gui.add_html(page_script(shown.name))
        gui.add_html(
            words.block(f"<h1 style='font-size:1.1em;margin:4px 0'>{escape(shown.name)}</h1>")
        )
        self.text = gui.add_html("")
        self.improve = gui.add_button("Improve this grasp", color=(0, 80, 130))
        self.acts = gui.add_button_group("", ("Undo", "Revert", "Home"))
        self.said = gui.add_html("")
        tabs = gui.add_tab_group()
        with tabs.add_tab("Grasp"):
            self.rank = gui.add_slider(
                "ranked grasp", 1, max(count, 2), 1, 1, disabled=len(self.grasps) < 2
            )
            self.ranking = gui.add_html("")
            self._sliders()
        with tabs.add_tab("See"):
            self.colors = Colors(self)
            self.object_shown = gui.add_checkbox("object", True)
            self.net_shown = gui.add_checkbox("fitted surface", self.fit.mesh is None)
            self.cones_shown = gui.add_checkbox("friction cones", True)
            self.weakest_shown = gui.add_checkbox("weakest push and twist", True)
            cloud = self.fit.mesh is None
            soft = shown.hand.torsion > 0.0
            with gui.add_folder("Legend"):
                gui.add_html(words.legend(len(self.held.fingers), cloud=cloud, soft=soft))
            gui.add_html(words.block(words.known(self.fit)))
        with tabs.add_tab("Pull"):
            self.pull = Pull(self)
        with tabs.add_tab("Save"):
            self.places = gui.add_html("")
            self.saves = gui.add_button_group("", ("Copy JSON", "Save JSON", "Save PNG"))
            self.json = gui.add_html("")
            gui.add_html(
                words.block(
                    "<b>Keyboard</b><br>1 … 9 choose a finger; I J K L move it up, left, down and "
                    "right along the object. Home: the best view. U: undo. R: revert. O: improve."
                )
            )
        self.net.visible = self.net_shown.value
        self.rank.on_update(lambda _: self.choose(int(self.rank.value) - 1))
        for slider in (self.friction, self.edges):
            slider.on_update(lambda _: self.redraw())
        self.improve.on_click(lambda _: self.climb())

        @self.acts.on_click
        def _(event: Any) -> None:
            {"Undo": self.undo, "Revert": self.revert, "Home": self.home}[event.target.value]()

        @self.saves.on_click
        def _(event: Any) -> None:
            self._save(event.target.value)

        self.object_shown.on_update(lambda _: self._visible())
        self.net_shown.on_update(lambda _: self._visible())
        self.cones_shown.on_update(lambda _: self.redraw())
        self.weakest_shown.on_update(lambda _: self.redraw())

    def _sliders(self) -> None:
        friction, edges = self.shown.hand.friction, self.shown.hand.edges
        low, high = min(FRICTIONS[0], friction), max(FRICTIONS[1], friction)
        # A step that meets what was asked for, from an end of the range that was widened or not.
        step = 0.05 if abs((friction - low) / 0.05 % 1.0 - 0.5) > 0.499 else 1e-3 * high
        gui = self.client.gui
        self.friction = gui.add_slider("friction μ", low, high, step, friction)
        self.edges = gui.add_slider("cone edges l", EDGES[0], max(EDGES[1], edges), 1, edges)

    def _visible(self) -> None:
        self.object.visible = bool(self.object_shown.value) and not self.colors.on
        self.net.visible = bool(self.net_shown.value)

    def _keys(self) -> None:
        gui = self.client.gui
        for index in range(min(len(self.held.fingers), 9)):
            command = gui.add_command(f"choose finger {index + 1}", hotkey=str(index + 1))
            command.on_trigger(self._chooser(index))
        for key, way in KEYS.items():
            gui.add_command(f"move the finger ({key})", hotkey=key).on_trigger(self._mover(way))
        for key, name, act in (
            ("home", "best view", self.home),
            ("U", "undo", self.undo),
            ("R", "revert", self.revert),
            ("O", "improve", self.climb),
        ):
            gui.add_command(name, hotkey=key).on_trigger(self._actor(act))

    def _actor(self, act: Callable[[], None]) -> Callable[[Any], None]:
        return lambda _: act()

    def _chooser(self, index: int) -> Callable[[Any], None]:
        def choose(_: Any) -> None:
            self.chosen = index
            self.say(f"finger {index + 1} is moved by I J K L")

        return choose

    def _mover(self, way: tuple[float, float]) -> Callable[[Any], None]:
        return lambda _: self.nudge(self.chosen, way)

    # What is done to the grasp ------------------------------------------------------------------

    @property
    def hand(self) -> Hand:
        """With what the quality is computed now."""
        friction, edges = float(self.friction.value), int(self.edges.value)
        return self.shown.hand._replace(friction=friction, edges=edges)

    def choose(self, rank: int) -> None:
        """One of the grasps on offer, from 0, seen from where it is seen best."""
        if rank < len(self.grasps):
            with self.lock:
                self.rank_shown = rank
                self.past.clear()
                self.qualities.clear()
                self.show(self.touch.held(self.grasps[rank]))
            self.home()

    def change(self, held: Held) -> None:
        """Another grasp, which can be undone."""
        with self.lock:
            self.past.append(self.held)
            self.show(held)

    def undo(self) -> None:
        """Back to what was before the last change."""
        with self.lock:
            if not self.past:
                self.say("nothing to undo")
                return
            self.show(self.past.pop())
            self.say("undone")

    def revert(self) -> None:
        """Back to the grasp as it was offered."""
        with self.lock:
            if not self.grasps:
                self.say("there is no grasp on offer to go back to")
            elif self.held.offered is not None:
                self.say("the grasp is as it was offered")
            else:
                self.change(self.touch.held(self.grasps[self.rank_shown]))
                self.say(f"grasp {self.rank_shown + 1} as it was offered")

    def climb(self) -> None:
        """A better grasp, or why there is none."""
        with self.lock:
            better, said = improved(self.touch, self.held, self.hand)
            if better is not None:
                self.change(better)
        self.say(said)

    def put(self, index: int, contact: Contact) -> None:
        """A finger elsewhere, not to be undone on its own."""
        with self.lock:
            self.chosen = index
            self.show(self.held.with_finger(index, contact))

    def _dragger(self, index: int) -> Callable[[Any], Any]:
        # Awaited one after the other, so that moves come in their order.
        async def dragged(event: Any) -> None:
            if event.phase == "start":
                with self.lock:
                    self.past.append(self.held)
                    self.colors.drag(index)
                return
            if event.phase == "update":
                eye = self.in_object(np.asarray(event.client.camera.position))
                through = self.in_object(np.asarray(event.end_position))
                self.put(index, self.touch.put(*self.touch.under(eye, through)))
                return
            self.colors.drop()

        return dragged

    def nudge(self, index: int, way: tuple[float, float]) -> None:
        """A finger moved a little, to the right and up as it is seen."""
        with self.lock:
            finger = self.held.fingers[index]
            eye = self.in_object(np.asarray(self.client.camera.position))
            forward = finger.point - eye
            up = self.fit.pose[:3, 2]
            right = np.cross(forward, up)
            right /= np.linalg.norm(right)
            upward = np.cross(right, forward)
            upward /= np.linalg.norm(upward)
            along = way[0] * right + way[1] * upward
            along = along - (along @ finger.normal) * finger.normal
            length = float(np.linalg.norm(along))
            if length < 1e-6:
                return
            aim = finger.point + STEP * self.touch.size * along / length
            # From outside, as a finger comes: where the object is met beside the old place.
            start = aim - 0.5 * self.touch.size * finger.normal
            self.past.append(self.held)
            self.put(index, self.touch.put(*self.touch.under(start, aim)))

    def in_object(self, point: Floats) -> Floats:
        """A point of the scene in the object's coordinates."""
        return self.fit.to_object(self.fit.length_scale * point)

    def home(self, *, ease: bool = True) -> None:
        """The best view of the grasp; the object is see-through where it hides a finger."""
        contacts = local(self.fit, self.held.contacts)
        normals = self.held.normals @ self.fit.pose[:3, :3]
        seen = self.eye.home(contacts, normals, self.arrows, ease=ease)
        self._weakest()
        if self.shown.thing.faces is not None:
            self.object.opacity = None if seen.all() else 0.55

    def _reshaped(self) -> None:
        """Another window, another frame: its panel opens after the first picture."""
        aspect = float(self.client.camera.aspect)
        if abs(aspect - self.aspect) > 0.02:
            self.aspect = aspect
            self.home(ease=False)

    # What is shown ------------------------------------------------------------------------------

    def say(self, text: str) -> None:
        """What was just done."""
        self.said.content = words.block(
            f"<span role='status' data-said>{escape(text)}</span>", "min-height:1.5em"
        )

    def redraw(self) -> None:
        """The same grasp, with other options."""
        with self.lock:
            self.show(self.held)
            self.colors.refresh()

    def show(self, held: Held) -> None:
        """Draws a grasp and says what it is worth."""
        with self.lock, self.client.atomic():
            self.held = held
            hand, scene = self.hand, self.client.scene
            turn = self.fit.pose[:3, :3]
            points, normals = local(self.fit, held.contacts), held.normals @ turn
            pad = self.touch.radius / self.touch.scale if hand.torsion > 0.0 else 0.0
            for index, finger in enumerate(held.fingers):
                bad = bool(finger.why)
                self.balls[index].position = points[index]
                color = DARK if bad else finger_color(index)
                if tuple(self.balls[index].color) != color:
                    self.balls[index].color = color
                self.cages[index].position = points[index]
                self.cages[index].visible = bad
                number = f"{index + 1}{' ✗' if bad else '' if finger.check.seen else ' ?'}"
                draw_finger(
                    scene, index, points[index], normals[index], hand.friction, hand.edges,
                    pad=pad, number=number, cones=bool(self.cones_shown.value),
                )  # fmt: skip
            self._weakest()
            self._write(held, hand)
            self.pull.show()

    def _weakest(self) -> None:
        """The arrows of what is resisted least."""
        turn, center = self.fit.pose[:3, :3], local(self.fit, self.touch.center)
        push, twist = (one @ turn for one in self.touch.weakest(self.held, self.hand))
        shown = bool(self.weakest_shown.value) and not self.pull.on
        self.arrows = draw_weakest(
            self.client.scene, center, push, twist, self.eye.outline, self.eye.way, shown=shown
        )

    def _write(self, held: Held, hand: Hand) -> None:
        value = self.touch.worth(held, hand)
        self.qualities.append(value)
        modified = ""
        if held.offered is None:
            modified = (
                f"modified from grasp {self.rank_shown + 1}" if self.grasps else "set by hand"
            )
        self.text.content = words.state(
            self.fit, held, value, hand, self.touch.untrue(held, hand), modified=modified,
            past=self.qualities,
        )  # fmt: skip
        offered = in_order(self.grasps, self.touch, hand)
        self.ranking.content = words.ranking(
            offered, self.rank_shown if held.offered is not None else -1, hand
        )
        self.places.content = words.contacts(held, self.touch.size)

    # Out ----------------------------------------------------------------------------------------

    def _save(self, what: str) -> None:
        stem = PurePath(self.shown.name).stem
        if what == "Save PNG":
            camera = self.client.camera
            image = self.client.get_render(
                height=int(camera.image_height), width=int(camera.image_width)
            )
            from PIL import Image

            buffer = io.BytesIO()
            Image.fromarray(image).convert("RGB").save(buffer, format="PNG")
            self.client.send_file_download(f"{stem}.png", buffer.getvalue(), save_immediately=True)
            self.say(f"saved {stem}.png")
            return
        text = self.as_json()
        if what == "Save JSON":
            self.client.send_file_download(f"{stem}.json", text.encode(), save_immediately=True)
            self.say(
                f"saved {stem}.json: graspmoduli view OBJECT --grasps {stem}.json shows it again"
            )
        else:
            # The page's script copies it.
            self.json.content = f"<pre hidden data-json data-copy>{escape(text)}</pre>"
            self.say("copied the grasp as JSON")

    def as_json(self) -> str:
        """The grasp that is shown, first, and the others on offer, as ``grasp --json`` has them."""
        with self.lock:
            hand = self.hand
            now = self.touch.as_grasp(self.held, hand)
            others = [one for one in self.grasps if one is not self.held.offered]
            grasps = [now, *(self.touch.as_grasp(self.touch.held(one), hand) for one in others)]
        if self.shown.report is None:
            return json.dumps({"grasps": [one.contacts.tolist() for one in grasps]})
        return json.dumps(self.shown.report(grasps, hand), indent=2) + "\n"
