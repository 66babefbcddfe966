"""What the page says of a grasp, as HTML."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

from ..objects.fitting import Fit
from .drawing import FINGERS, NET
from .held import Hand, Held

#: Good news and bad, readable on white and on dark.
GOOD, BAD, UNSURE = "good", "bad", "unsure"
#: Share of a pad that is little to bear.
LITTLE = 0.4


def block(text: str, style: str = "") -> str:
    """A paragraph of the panel."""
    return f"<div style='padding:2px 12px;line-height:1.4;{style}'>{text}</div>"


def truth(fit: Fit, held: Held, untrue: str) -> tuple[str, str]:
    """Is the grasp true on the object? Good, bad or unsure, and the sentence."""
    if untrue:
        return BAD, f"Not true on the object: {untrue}"
    if fit.mesh is not None:
        text = "True on the object: a straight finger touches the mesh at every contact."
        if held.held is not None:
            share = "All" if held.held >= 1.0 else f"{held.held:.0%}"
            text += f" {share} of the errors of aim that were tried leave force closure."
        least = min(finger.check.bearing for finger in held.fingers)
        if least < LITTLE:
            text += f" But as little as {least:.0%} of a pad bears: it is thin there."
        return GOOD, text
    seen = f" {fit.coverage:.0%} of the fitted surface was seen."
    if held.unseen:
        names = " and ".join(str(k) for k in held.unseen)
        who = f"finger {names} touches" if len(held.unseen) == 1 else f"fingers {names} touch"
        return UNSURE, f"Not sure: {who} what was not seen; the object may be otherwise.{seen}"
    return GOOD, f"True as far as was seen: every finger touches points that were seen.{seen}"


def known(fit: Fit) -> str:
    """How much of the object is known, and how much its fitted surface explains."""
    if fit.mesh is not None:
        return (
            f"The mesh is known all over; the fitted surface (net) explains "
            f"{1.0 - fit.unexplained:.0%} of it."
        )
    return (
        f"{fit.coverage:.0%} of the fitted surface was seen; it explains "
        f"{1.0 - fit.unexplained:.0%} of what was seen."
    )


def name_of(hand: Hand) -> str:
    """The sign of the quality, as HTML."""
    return f"Q{'′' if hand.norm == 'each' else ''}<sub>{hand.edges}</sub>"


def meaning(value: float, hand: Hand, scale: float) -> str:
    """What a quality means, in newtons."""
    if value <= 0.0:
        return (
            "There is a push or a twist that these fingers cannot resist, however hard they press: "
            "the arrows show it."
        )
    force = (
        "with at most 1 N normal force each" if hand.norm == "each"
        else "with 1 N of normal force in sum"
    )  # fmt: skip
    return (
        f"{force[0].upper()}{force[1:]} the fingers resist every push up to {value:.3f} N, or "
        f"instead every twist up to {value * scale:.3g} N × the unit of length, or a mixture in "
        "proportion."
    )


def explained(hand: Hand, scale: float) -> str:
    """What Q is, in a sentence."""
    limit = "are at most 1 N each" if hand.norm == "each" else "sum to 1 N"
    return (
        f"{name_of(hand)} is the largest disturbance, in any direction, that the fingers resist "
        f"while their normal forces {limit}, with friction "
        f"μ = {hand.friction:g} and cones of {hand.edges} edges. A torque counts divided by "
        f"{scale:.4g}, the object's radius about its centre of mass in the unit of its file."
    )


def state(
    fit: Fit,
    held: Held,
    value: float,
    hand: Hand,
    untrue: str,
    *,
    modified: str = "",
    past: Sequence[float] = (),
) -> str:
    """The truth, then Q and what it means. The heights of the lines do not change."""
    kind, sentence = truth(fit, held, untrue)
    closed = value > 0.0
    shade = GOOD if kind == GOOD else BAD
    changed = f" · <b>{escape(modified)}</b>" if modified else ""
    return block(
        f"<div data-truth='{kind}' class='gm-{shade}' style='min-height:4.2em'>"
        f"{'✓' if kind == GOOD else '⚠'} {escape(sentence)}</div>"
        f"<div style='display:flex;align-items:center;justify-content:space-between'>"
        f"<span style='font-size:1.5em'>{name_of(hand)} = <b data-quality>{value:.4f}</b></span>"
        f"{sparkline(past)}</div>"
        f"<div><b data-closure class='gm-{GOOD if closed else BAD}'>"
        f"{'force closure' if closed else 'not force closure'}</b>"
        f"<span data-modified>{changed}</span></div>"
        f"<div style='min-height:5.6em'>{escape(meaning(value, hand, fit.length_scale))}</div>"
    )


def sparkline(past: Sequence[float]) -> str:
    """Q over the last moves."""
    values = list(past)[-40:]
    if len(values) < 2:
        return ""
    top = max(*values, 1e-9)
    points = " ".join(
        f"{100.0 * k / (len(values) - 1):.1f},{22.0 - 20.0 * value / top:.1f}"
        for k, value in enumerate(values)
    )
    said = f"Q over the last {len(values)} moves, from {values[0]:.3f} to {values[-1]:.3f}"
    return (
        f"<svg data-past='{len(values)}' role='img' aria-label='{said}' width='104' height='24' "
        f"viewBox='-2 0 104 24'><title>{said}</title>"
        f"<polyline points='{points}' fill='none' stroke='currentColor' stroke-width='1.5'/></svg>"
    )


def ranking(values: Sequence[float], chosen: int, hand: Hand) -> str:
    """The grasps on offer with their present quality. ``chosen`` from 0, -1 for none."""
    if not values:
        return block("No grasp was found: put the fingers where you like.")
    top = max(values)
    rows = []
    for k, value in enumerate(values):
        width = 0.0 if top <= 0.0 else 100.0 * value / top
        mark = " aria-current='true' style='font-weight:bold'" if k == chosen else ""
        best = " best" if value == top > 0.0 else ""
        rows.append(
            f"<tr data-rank='{k + 1}'{mark}><td>{'▸' if k == chosen else ''}</td><td>{k + 1}</td>"
            f"<td>{value:.4f}</td><td style='width:45%'><div class='gm-bar' "
            f"style='width:{width:.0f}%'></div></td><td>{best}</td></tr>"
        )
    return block(
        f"<table class='gm-table' data-ranking><thead><tr><td></td><th>grasp</th>"
        f"<th>{name_of(hand)}</th><td></td><td></td></tr></thead><tbody>{''.join(rows)}</tbody>"
        "</table>"
    )


def contacts(held: Held, size: float) -> str:
    """Contacts in the object's own coordinates and unit."""
    digits = max(0, 3 - math.floor(math.log10(size)))
    rows = []
    for k, finger in enumerate(held.fingers):
        color = FINGERS[k % len(FINGERS)]
        cells = "".join(f"<td>{_rounded(x, digits):.{digits}f}</td>" for x in finger.point.tolist())
        mark = "✗" if finger.why else "" if finger.check.seen else "?"
        rows.append(
            f"<tr><td><span class='gm-dot' style='background:{color}'></span>{k + 1}{mark}</td>"
            f"{cells}</tr>"
        )
    return block(
        "<table class='gm-table' data-contacts><thead><tr><th>finger</th><th>x</th><th>y</th>"
        f"<th>z</th></tr></thead><tbody>{''.join(rows)}</tbody></table>"
        "In the coordinates and the unit of the object's file."
    )


def legend(count: int, *, cloud: bool, soft: bool, moves: bool = True) -> str:
    """What the marks in the picture mean."""

    def item(mark: str, text: str) -> str:
        return f"<li><span class='gm-key' aria-hidden='true'>{mark}</span>{text}</li>"

    dots = "".join(
        f"<span class='gm-dot' style='background:{FINGERS[k % len(FINGERS)]}'></span>"
        for k in range(count)
    )
    cone = "<span style='color:#D55E00'>◁</span>"
    items = [
        item(dots, "fingertips with their numbers" + (": drag one" if moves else "")),
        item(cone, "friction cone, its point at the contact; the arrow is how the finger comes"),
        item("✗", "after a number, black: no finger touches like this"),
        item("↗", "weakest push, from the centre of mass"),
        item("↻", "weakest twist, about its axis"),
        item(f"<span style='color:{NET}'>▦</span>", "fitted surface"),
    ]
    if soft:
        items.insert(1, item("●", "pad of a soft finger"))
    if cloud:
        items.append(item("<span style='color:#a8763e'>∴</span>", "points that were seen"))
        items.append(item("?", "after a number: that contact was not seen"))
    return block(f"<ul class='gm-legend'>{''.join(items)}</ul>")


def colors(low: float, high: float, what: str, bar: float | None = None) -> str:
    """The key of the colours on the surface."""
    grey = "" if bar is None else f" Grey: less than {bar:.3f}."
    return block(
        f"<div data-colors>{escape(what)}</div><div style='height:12px;border:1px solid "
        "currentColor;background:linear-gradient(to right,#00224e,#575d6d,#a59c74,#fee838)'></div>"
        f"<div><span data-low>{low:.3f}</span><span data-high style='float:right'>{high:.3f}</span>"
        f"</div>{grey}"
    )


def _rounded(x: float, digits: int) -> float:
    return round(float(x), digits) + 0.0
