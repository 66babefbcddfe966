"""Draws the figures of the pages on mathematics and of the glossary: python docs/hooks/figures.py

They are computed, not sketched: what they show is what the text says.
"""

from itertools import product
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Arc, Polygon, Rectangle

import graspmoduli as gm

FOLDER = Path(__file__).parent.parent / "images" / "figures"
BLUE, ORANGE, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "0.45"
COLORS = (ORANGE, BLUE, GREEN)


def arrow(axes, start, vector, color, width=1.8, **options):
    axes.annotate(
        "", np.add(start, vector), start,
        arrowprops={"arrowstyle": "-|>", "color": color, "lw": width, "shrinkA": 0, "shrinkB": 0},
        **options,
    )  # fmt: skip


def bare(axes):
    axes.set_aspect("equal")
    axes.axis("off")


def vertices():
    """Planar twin of the two kinds of vertices: there an apex counts 2 and a ray 1."""
    angles = np.radians([95.0, 215.0, 320.0])
    contacts = np.stack([np.cos(angles), np.sin(angles)], axis=1) * [[1.0], [0.9], [1.1]]
    pressing = angles + np.pi + np.radians([8.0, -5.0, 10.0])
    normals = np.stack([np.cos(pressing), np.sin(pressing)], axis=1)
    across = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
    friction = 0.6
    # Rays of the polar of the cone of n ± μ t.
    rays = np.stack([across - friction * normals, -across - friction * normals], axis=1)

    def moved(twist):
        return twist[:2] + twist[2] * np.stack([-contacts[:, 1], contacts[:, 0]], axis=1)

    def row(i, direction):
        lever = direction @ np.array([-contacts[i, 1], contacts[i, 0]])
        return [*direction, lever], direction @ normals[i]

    def is_vertex(twist):
        away = moved(twist) - normals
        edges = np.stack([normals + friction * across, normals - friction * across], axis=1)
        return (np.einsum("ijk,ik->ij", edges, away) <= 1e-9).all()

    def solve(rows):
        lines, wanted = zip(*rows, strict=True)
        return np.linalg.solve(np.array(lines), np.array(wanted))

    def on_ray(i, j):
        x, y = rays[i, j]
        return row(i, np.array([-y, x]))

    all_rays = [
        t for js in product(range(2), repeat=3)
        if is_vertex(t := solve([on_ray(i, j) for i, j in enumerate(js)]))
    ]  # fmt: skip
    apexes = [
        t for i, k, j in product(range(3), range(3), range(2)) if i != k
        if is_vertex(t := solve([row(i, np.array([1.0, 0.0])), row(i, np.array([0.0, 1.0])),
                                 on_ray(k, j)]))
    ]  # fmt: skip
    scale = 0.4
    fig, panels = plt.subplots(1, 2, figsize=(9.0, 4.2), layout="constrained")
    kinds = ("every velocity on a ray", "one at its apex, one on a ray, one free")
    for axes, found, title in zip(panels, (all_rays, apexes), kinds, strict=True):
        twist = min(found, key=np.linalg.norm)
        axes.add_patch(Polygon(contacts, closed=True, fill=False, color="0.8", linewidth=1.2))
        for i, color in enumerate(COLORS):
            apex = contacts[i] + scale * normals[i]
            corner = [apex, apex + rays[i, 0], apex + rays[i, 1]]
            axes.add_patch(Polygon(corner, color=color, alpha=0.14, linewidth=0))
            for ray in rays[i]:
                axes.plot(*np.array([apex, apex + ray]).T, color=color, linewidth=1.0)
            axes.plot(*np.array([contacts[i], apex]).T, ":", color=color, linewidth=1.0)
            axes.plot(*contacts[i], "o", color=color, markersize=8)
            arrow(axes, contacts[i], scale * moved(twist)[i], color)
        axes.set_title(title, fontsize=12)
        axes.set_xlim(-2.1, 2.1)
        axes.set_ylim(-1.7, 1.7)
        bare(axes)
    fig.supxlabel(
        "arrows: velocities of one rigid motion; shaded: $n_i + C_i^\\circ$, where they must end",
        fontsize=10,
    )
    return fig


def polytope():
    """Three steps of an expanding polytope in the plane."""
    generator = np.random.default_rng(5)
    angle = np.sort(generator.random(14)) * 2 * np.pi
    points = np.stack([1.5 * np.cos(angle), np.sin(angle)], axis=1)
    points *= generator.uniform(0.8, 1.1, size=(14, 1))
    points += [0.25, 0.1]
    inner = [0, 5, 10]
    fig, panels = plt.subplots(1, 3, figsize=(10.0, 3.2), layout="constrained")
    for axes in panels:
        ring = points[sorted(inner)]
        ends = np.roll(ring, -1, axis=0)
        outward = np.stack([(ends - ring)[:, 1], -(ends - ring)[:, 0]], axis=1)
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        distances = (outward * ring).sum(1)
        nearest = int(distances.argmin())
        normal = outward[nearest]
        farthest = int((points @ normal).argmax())
        axes.plot(*points.T, ".", color="0.6")
        axes.add_patch(Polygon(ring, closed=True, facecolor=BLUE, alpha=0.12))
        axes.add_patch(Polygon(ring, closed=True, fill=False, edgecolor=BLUE, linewidth=1.4))
        axes.plot(*np.array([ring[nearest], ends[nearest]]).T, color=ORANGE, linewidth=3)
        axes.plot(0, 0, "k+", markersize=10)
        arrow(axes, (0, 0), distances[nearest] * normal, ORANGE)
        axes.plot(*points[farthest], "o", color=GREEN, markersize=9)
        side = np.array([-normal[1], normal[0]])
        reach = points[farthest] @ normal
        line = np.array([reach * normal - 0.7 * side, reach * normal + 0.7 * side])
        axes.plot(*line.T, "--", color=GREEN, linewidth=1)
        axes.set_title(f"{distances[nearest]:.2f} ≤ Q ≤ {reach:.2f}", fontsize=12)
        axes.set_xlim(-1.6, 2.1)
        axes.set_ylim(-1.15, 1.35)
        bare(axes)
        inner.append(farthest)
    fig.supxlabel(
        "orange: the nearest facet, a lower bound; "
        "green: the farthest point beyond it, an upper one",
        fontsize=10,
    )
    return fig


def ascent():
    """Q of the bottle's best grasp, and of its facets, along a line through the maximum."""
    bottle = gm.shapes.model("bottle")
    best = gm.synthesize(bottle, top=1)[0]
    line = np.linspace(-0.09, 0.09, 361)

    def at(x):
        return gm.Grasp(np.clip(best.grasp.u + x * np.array([0.0, 1.0, 0.0]), 0, 1),
                        best.grasp.theta)  # fmt: skip

    q = np.array([gm.quality(gm.place(bottle, at(x))) for x in line])
    left, right = -0.06, 0.04
    tops = []
    fig, axes = plt.subplots(figsize=(7.2, 3.9), layout="constrained")
    axes.plot(line, q, color="0.2", linewidth=2.2, label="Q")
    for x, color in ((left, BLUE), (right, ORANGE)):
        slope = gm.grasp_gradient(bottle, at(x))
        value, along = slope.value, float(slope.u[1])
        tops.append((value - along * x, along))
        axes.plot(line, value + along * (line - x), "--", color=color, linewidth=1.3,
                  label="a facet, to first order")  # fmt: skip
        axes.plot(x, value, "o", color=color, markersize=7)
    (a, b), (c, d) = tops
    meet = (c - a) / (b - d)
    axes.plot(meet, a + b * meet, "v", color=GREEN, markersize=10, label="a step that sees both")
    axes.plot(0, best.quality, "k*", markersize=12, label="the maximum")
    axes.set_ylim(q.min() - 0.01, q.max() + 0.035)
    axes.set_xlabel("one contact's u, less that of the maximum")
    axes.set_ylabel("$Q_8$")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=9, loc="lower right")
    return fig


def distance():
    """Cells of a branch and bound of d between two models, bounds from samples."""
    first, last = gm.shapes.model("pear"), gm.shapes.model("grip")
    n = 257
    u, theta = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 2 * np.pi, n), indexing="ij")
    shape = (n, n, 3)

    def field(what):
        return np.linalg.norm(
            (getattr(first, what)(u.ravel(), theta.ravel())
             - getattr(last, what)(u.ravel(), theta.ravel())).reshape(shape), axis=2
        )  # fmt: skip

    values = np.maximum(field("points"), field("normals"))
    slope_u, slope_t = np.gradient(values, u[1, 0], theta[0, 1])
    found, kept, cells = 0.0, [], [(0, n - 1, 0, n - 1, 0)]
    while cells:
        a, b, c, d, depth = cells.pop(0)
        block = np.s_[a : b + 1, c : d + 1]
        middle = values[(a + b) // 2, (c + d) // 2]
        found = max(found, middle)
        along = np.abs(slope_u[block]).max() * (u[b, 0] - u[a, 0])
        around = np.abs(slope_t[block]).max() * (theta[0, d] - theta[0, c])
        bound = middle + 0.5 * (along + around)
        if bound <= found * 1.001 or depth == 7:
            kept.append((u[a, 0], u[b, 0], theta[0, c], theta[0, d]))
            continue
        e, f = (a + b) // 2, (c + d) // 2
        cells += [(a, e, c, f, depth + 1), (a, e, f, d, depth + 1),
                  (e, b, c, f, depth + 1), (e, b, f, d, depth + 1)]  # fmt: skip
    fig, axes = plt.subplots(figsize=(7.2, 3.9), layout="constrained")
    picture = axes.pcolormesh(theta, u, values, cmap="cividis", shading="gouraud", rasterized=True)
    for low, high, start, end in kept:
        axes.add_patch(Rectangle((start, low), end - start, high - low, fill=False,
                                 edgecolor="white", linewidth=0.5))  # fmt: skip
    top = np.unravel_index(values.argmax(), values.shape)
    axes.plot(theta[top], u[top], "o", color=ORANGE, markersize=9, markeredgecolor="white")
    axes.set(xlabel="θ", ylabel="u", xticks=[0, np.pi, 2 * np.pi], xticklabels=["0", "π", "2π"])
    fig.colorbar(picture, label="points or normals apart, pear and grip")
    return fig


def glossary():
    """(u, θ) on a surface, a friction cone with its frame, a wrench."""
    fig = plt.figure(figsize=(11.0, 4.0), layout="constrained")
    axes = fig.add_subplot(1, 3, 1, projection="3d")
    vase = gm.shapes.model("vase")
    u, theta = np.meshgrid(np.linspace(0, 1, 50), np.linspace(0, 2 * np.pi, 60), indexing="ij")
    points = vase.points(u.ravel(), theta.ravel()).reshape(50, 60, 3)
    axes.plot_surface(*np.moveaxis(points, 2, 0), color="#d9cfc0", alpha=0.55, linewidth=0)
    ring = vase.points(np.full(60, 0.62), np.linspace(0, 2 * np.pi, 60))
    axes.plot(*ring.T, color=BLUE, linewidth=2)
    side = vase.points(np.linspace(0, 1, 50), np.full(50, -0.7))
    axes.plot(*side.T, color=ORANGE, linewidth=2)
    axes.plot(*vase.points(0.62, -0.7), "ko", markersize=7)
    axes.text(*(1.25 * vase.points(0.1, -0.7)), "u from 0\nto 1", color=ORANGE, fontsize=11)
    axes.text(*(1.4 * vase.points(0.62, 0.3)), "θ around", color=BLUE, fontsize=11)
    axes.set_title("a contact (u, θ) on a surface", fontsize=12)
    axes.set_box_aspect((1, 1, 1.5))
    axes.view_init(18, -50)
    axes.axis("off")

    axes = fig.add_subplot(1, 3, 2, projection="3d")
    friction, l = 0.7, 8
    angle = 2 * np.pi * np.arange(l + 1) / l
    rim = np.stack([friction * np.cos(angle), friction * np.sin(angle), np.ones(l + 1)], axis=1)
    for edge in rim[:-1]:
        axes.plot(*np.array([[0, 0, 0], edge]).T, color=BLUE, linewidth=1.4)
    axes.plot(*rim.T, color=BLUE, linewidth=1.4)
    names = {"n, inward": (0, 0, 1.25), "R(n) e₁": (0.9, 0, 0), "R(n) e₂": (0, 0.9, 0)}
    for name, way in names.items():
        vector = np.array(way)
        axes.quiver(0, 0, 0, *vector, color="0.25", arrow_length_ratio=0.12)
        axes.text(*(1.1 * vector), name, fontsize=11)
    axes.text(*(1.1 * rim[0]), "edge $f_{ij}$", color=BLUE, fontsize=11)
    axes.set_zlim(0.0, 1.4)
    axes.set_title(f"a friction cone of {l} edges, μ = {friction}", fontsize=12)
    axes.view_init(16, -60)
    axes.set_box_aspect((1, 1, 1))
    axes.axis("off")

    axes = fig.add_subplot(1, 3, 3)
    axes.add_patch(Polygon([[-1.2, -0.9], [1.3, -0.8], [1.2, 0.9], [-1.0, 1.0]], closed=True,
                           facecolor="#d9cfc0", alpha=0.6))  # fmt: skip
    contact, force = np.array([1.25, 0.1]), np.array([-0.75, 0.55])
    axes.plot(0, 0, "ko", markersize=7)
    axes.text(0.1, -0.3, "z, centre of mass", ha="left", fontsize=11)
    axes.plot(*np.array([[0, 0], contact]).T, ":", color="0.3")
    axes.text(0.55, 0.1, "c − z", fontsize=11)
    axes.plot(*contact, "o", color=BLUE, markersize=9)
    arrow(axes, contact, force, BLUE)
    axes.text(0.62, 0.68, "force f", color=BLUE, fontsize=11)
    axes.add_patch(Arc((0, 0), 0.9, 0.9, theta1=100, theta2=250, color=ORANGE, linewidth=1.8))
    arrow(axes, (-0.17, -0.42), (0.09, -0.035), ORANGE)
    axes.text(-0.55, 0.45, "torque\n(c − z) × f", color=ORANGE, ha="center", fontsize=11)
    axes.set_title("a wrench: force and torque", fontsize=12)
    axes.set_xlim(-1.4, 1.6)
    axes.set_ylim(-1.1, 1.2)
    bare(axes)
    return fig


if __name__ == "__main__":
    FOLDER.mkdir(parents=True, exist_ok=True)
    for draw in (vertices, polytope, ascent, distance, glossary):
        draw().savefig(FOLDER / f"{draw.__name__}.png", dpi=110)
        print(f"wrote {draw.__name__}.png")
