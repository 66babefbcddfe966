"""The eye of one browser: it goes where a grasp is seen best."""

from __future__ import annotations

import contextlib
import threading
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._arrays import Floats
from ...objects.fitting import Fit
from ...objects.reading import Object
from ..forms import CONE, in_the_way, local
from ..look import best_direction, framed

#: Steps of the way to a view, and the seconds that it takes.
STEPS, SECONDS = 10, 0.35
#: What the line of state covers of the picture's height, and the panel on a phone, up to a width.
COVERED, SHEET, PHONE = 0.06, 0.42, 0.7


class Eye:
    """The camera of one browser."""

    def __init__(self, client: Any, fit: Fit, thing: Object) -> None:
        self.client, self.fit = client, fit
        some = thing.samples[:: max(1, len(thing.samples) // 1500)]
        self.outline = local(fit, some)
        self.moves = 0
        #: Towards the eye, in the best view.
        self.way = np.array([1.0, 0.0, 0.0])

    def view(
        self, contacts: Floats, normals: Floats, others: list[Floats], aspect: float, fov: float
    ) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """Eye, what it looks at, and which contacts are seen from there."""
        way, seen = best_direction(contacts, normals, self.outline, in_the_way(self.fit))
        tails = contacts - 1.5 * CONE * normals
        eye, target = framed(
            np.concatenate([self.outline, contacts, tails, *others]), way, fov, aspect,
            top=COVERED, bottom=SHEET if aspect < PHONE else 0.0,
        )  # fmt: skip
        return eye, target, seen

    def home(
        self, contacts: Floats, normals: Floats, others: list[Floats], *, ease: bool
    ) -> NDArray[np.bool_]:
        """To the best view of contacts and other points; which contacts are seen from there."""
        camera = self.client.camera
        eye, target, seen = self.view(contacts, normals, others, camera.aspect, camera.fov)
        self.moves += 1
        self.way = (eye - target) / np.linalg.norm(eye - target)
        if ease:
            threading.Thread(target=self._ease, args=(eye, target, self.moves), daemon=True).start()
        else:
            self._look(eye, target)
        return seen

    def stop(self) -> None:
        """Nobody looks any more."""
        self.moves += 1

    def _look(self, eye: Floats, target: Floats) -> None:
        # Moving the camera takes what it looks at along, so that comes last.
        with self.client.atomic():
            self.client.camera.position = eye
            self.client.camera.look_at = target

    def _ease(self, eye: Floats, target: Floats, move: int) -> None:
        camera = self.client.camera
        start, before = np.asarray(camera.position), np.asarray(camera.look_at)
        one, other = start - before, eye - target
        far, wide = np.linalg.norm(one), np.linalg.norm(other)
        for share in np.linspace(0.0, 1.0, STEPS + 1)[1:]:
            # Another move has begun.
            if move != self.moves:
                return
            smooth = share * share * (3.0 - 2.0 * share)
            way = (1.0 - smooth) * one / far + smooth * other / wide
            length = float(np.linalg.norm(way))
            if share == 1.0 or length < 0.2:
                way, length = other / wide, 1.0
            at = (1.0 - smooth) * before + smooth * target
            with contextlib.suppress(UserWarning):
                # The browser may have gone in between.
                self._look(at + ((1.0 - smooth) * far + smooth * wide) * way / length, at)
            time.sleep(SECONDS / STEPS)
