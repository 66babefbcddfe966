"""Sec. IV.B to IV.E: grasps on surfaces, deformed, transferred, synthesised (Figs. 1–4, 8–12)."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..drawing import Camera, Scene, add_body, finish
from ..grasps import Grasp, place
from ..guarantees import certified_radius
from ..moduli import placed_distance, sample_combinations, sample_weights, surface_distance
from ..plotting import ELEVATION, LINES, plot_path, plot_row, plot_simplex
from ..quality import quality
from ..sampling import sample_points
from ..shapes import MODELS, NAMES
from ..surfaces import Surface, combine, project
from ..synthesis import best_grasps, plane_grasp, synthesize
from ..transfers import quality_along, transfer
from .report import BEYOND, IN_KIND, Outcome, Row
from .settings import Scale

#: The corners of the simplex of Fig. 1, and where on it Sec. IV.B looks.
CORNERS = "afk"
WEIGHTS = (0.3, 0.3, 0.4)
#: Sampled contacts of which the best three are a model's own grasp.
CONTACTS = 200
#: Fig. 8: how far surfaces and grasps are moved, and how many of each kind.
DISTANCES = (0.1, 0.3)
MOVED = 30
KINDS = ("grasp only", "surface only", "combined")
#: Fig. 9: intervals along each path.
STEPS = 50
METHODS = ("naive", "gradient", "ascent")
#: Fig. 11: surfaces, sampled contacts on each, surfaces per piece.
ROUND, ROUND_CONTACTS, ROUND_PIECE = 100, 100, 10
#: Fig. 12: the models without rotational symmetry, and the starts of our own method.
UNEVEN = "efghijkl"
STARTS = 40

Pieces = dict[str, list[Any]]
Seconds = dict[str, list[float]]


def own_grasp(surface: Surface, scale: Scale) -> tuple[Grasp, float]:
    """The best of all triples of 200 sampled contacts, as in Sec. IV.B and IV.C."""
    u, theta = sample_points(surface, CONTACTS, seed=scale.seed)
    found = best_grasps(surface, u, theta, friction=scale.friction, edges=scale.edges, threads=1)
    return found[0].grasp, found[0].quality


def listed(grasp: Grasp) -> list[list[float]]:
    """For JSON."""
    return [grasp.u.tolist(), grasp.theta.tolist()]


# Fig. 8 -----------------------------------------------------------------------------------------


def fig8_piece(index: int, scale: Scale) -> dict[str, Any]:
    """A grasp on a surface of the simplex, and what becomes of it nearby."""
    corners = [MODELS[name] for name in CORNERS]
    surface = combine(corners, WEIGHTS)
    start = time.perf_counter()
    grasp, value = own_grasp(surface, scale)
    searched = time.perf_counter() - start
    placed = place(surface, grasp)
    generator = np.random.Generator(np.random.Philox(key=scale.seed))
    weights = sample_weights(3, MOVED, scale.seed)
    moved: dict[str, Any] = {}
    for reach in DISTANCES:
        for kind in KINDS:
            cases = []
            for w in weights:
                target = surface
                if kind != "grasp only":
                    target = _surface_within(surface, combine(corners, w), reach)
                shifted = grasp
                if kind != "surface only":
                    push = generator.normal(size=(2, 3))
                    shifted = _grasp_within(surface, grasp, push, reach)
                at = place(target, shifted)
                cases.append(
                    {
                        "quality": quality(at, friction=scale.friction, edges=scale.edges),
                        "distance": placed_distance(placed, at),
                        "grasp": listed(shifted),
                        # How far towards which surface.
                        "weights": w.tolist(),
                    }
                )
            moved[f"{kind}, {reach:g}"] = cases
    return {
        "quality": value,
        "grasp": listed(grasp),
        "radius": certified_radius(placed, friction=scale.friction, edges=scale.edges),
        "moved": moved,
        "seconds": searched,
    }


def _surface_within(surface: Surface, other: Surface, reach: float) -> Surface:
    """On the line to another surface, as far as d(S, S') ≤ reach goes."""
    return _furthest(
        lambda t: combine([surface, other], [1.0 - t, t]),
        lambda moved: surface_distance(surface, moved, tolerance=1e-3),
        reach,
    )


def _grasp_within(surface: Surface, grasp: Grasp, push: Any, reach: float) -> Grasp:
    """Pushed in a direction of (u, θ), as far as d(g, g') ≤ reach goes."""
    placed = place(surface, grasp)

    def at(t: float) -> Grasp:
        return Grasp(np.clip(grasp.u + t * push[0], 0.0, 1.0), grasp.theta + t * push[1])

    return _furthest(at, lambda moved: placed_distance(placed, place(surface, moved)), reach)


def _furthest(at: Callable[[float], Any], distance: Callable[[Any], float], reach: float) -> Any:
    """By bisection in [0, 1]; the end itself if it is near enough."""
    if distance(at(1.0)) <= reach:
        return at(1.0)
    low, high = 0.0, 1.0
    for _ in range(12):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if distance(at(middle)) <= reach else (low, middle)
    return at(low)


def fig8(pieces: Pieces, seconds: Seconds, scale: Scale) -> Outcome:
    """ε-stability of one grasp under deformations."""
    found = pieces["fig8"][0]
    outcome = Outcome()
    outcome.rows = [
        Row("best Q₈ of C(200, 3) on the surface (0.3, 0.3, 0.4)", "IV.B", "0.33",
            f"{found['quality']:.4f}", IN_KIND, bool(abs(found["quality"] - 0.33) < 0.1),
            "the models are not the paper's"),
    ]  # fmt: skip
    for reach in DISTANCES:
        for kind in KINDS:
            values = [case["quality"] for case in found["moved"][f"{kind}, {reach:g}"]]
            paper = "stable" if reach == 0.1 else "stable; > 0.19 in one example"
            outcome.rows.append(
                Row(f"smallest Q₈ of {MOVED} deformations within {reach:g}, {kind}", "IV.B", paper,
                    f"{min(values):.4f}", IN_KIND, bool(min(values) > 0.0))
            )  # fmt: skip
    outcome.rows.append(
        Row("certified radius of this grasp", "IV.B", "0.1 (estimate, from Fig. 7)",
            f"{found['radius']:.4f}", BEYOND, None,
            "proven: every configuration within it is force closure")
    )  # fmt: skip
    outcome.times = [
        (
            "evaluating C(200, 3) = 1,313,400 grasps",
            "31 minutes",
            f"{found['seconds']:.3f} s of one core",
        )
    ]
    outcome.series = {
        "quality": found["quality"],
        "radius": found["radius"],
        "moved": found["moved"],
    }
    outcome.pictures = {"": partial(_fig8_picture, found)}
    return outcome


def _fig8_picture(found: dict[str, Any]) -> Figure:
    corners = [MODELS[name] for name in CORNERS]
    surface = combine(corners, WEIGHTS)
    points: list[tuple[Surface, Grasp]] = [(surface, Grasp(*found["grasp"]))]
    for kind in KINDS:
        case = found["moved"][f"{kind}, 0.3"][0]
        target = surface
        if kind != "grasp only":
            target = _surface_within(surface, combine(corners, case["weights"]), 0.3)
        points.append((target, Grasp(*case["grasp"])))
    return plot_row(points, ["the grasp", *(f"{kind}, 0.3" for kind in KINDS)])


# Fig. 9 -----------------------------------------------------------------------------------------

#: Where the interpolation transfer goes.
LEVEL = Grasp([0.5, 0.5, 0.5], [0.0, 2 * np.pi / 3, 4 * np.pi / 3])


def fig9_piece(index: int, scale: Scale) -> dict[str, Any]:
    """Q along the paths from one model to all others, by both transfers."""
    source = scale.fig9_sources[index]
    grasp, _ = own_grasp(MODELS[source], scale)
    paths: dict[str, Any] = {}
    for target, surface in MODELS.items():
        if target == source:
            continue
        for kind, end in (("naive", grasp), ("interpolation", LEVEL)):
            along = quality_along(
                (MODELS[source], grasp), (surface, end), samples=STEPS,
                friction=scale.friction, edges=scale.edges,
            )  # fmt: skip
            paths[f"{kind} {source}{target}"] = {
                "quality": along.quality.tolist(),
                "worst": [along.worst_t, along.worst_quality],
            }
    return paths


def fig9(pieces: Pieces, seconds: Seconds, scale: Scale) -> Outcome:
    """Quality along naïve and interpolation transfers."""
    paths = {key: path for piece in pieces["fig9"] for key, path in piece.items()}
    outcome = Outcome(series=paths)
    for kind, paper in (
        ("naive", "“rather tamely”; some unstable"), ("interpolation", "“a large amount” stable"),
    ):  # fmt: skip
        chosen = [path for key, path in paths.items() if key.startswith(kind)]
        stable = sum(path["quality"][-1] > 0.0 for path in chosen)
        held = sum(path["worst"][1] > 0.0 for path in chosen)
        outcome.rows += [
            Row(f"{kind} transfers that end force closure", "IV.C", paper,
                f"{stable} of {len(chosen)}", IN_KIND, stable > 0.3 * len(chosen)),
            Row(f"{kind} transfers that are force closure all the way", "IV.C", "–",
                f"{held} of {len(chosen)}", BEYOND, None, "the worst point between samples counts"),
        ]  # fmt: skip
        steepest = max(float(np.abs(np.diff(path["quality"])).max()) * STEPS for path in chosen)
        outcome.rows.append(
            Row(f"steepest slope of Q₈ along transfers, {kind}", "IV.C",
                "“seems to be Lipschitz continuous”", f"{steepest:.2f}", IN_KIND,
                None, "per unit of t, between samples; no criterion: any finite path has one")
        )  # fmt: skip
        outcome.pictures[f"-{kind}"] = partial(_fig9_picture, kind, paths)
    return outcome


def _fig9_picture(kind: str, paths: dict[str, Any]) -> Figure:
    figure = Figure(figsize=(7.2, 4.0), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    # As in the paper: from a, i and j; the others faint.
    colors = {"a": LINES[1], "i": LINES[5], "j": LINES[0]}
    seen = set()
    for key, path in paths.items():
        name, pair = key.split()
        if name != kind:
            continue
        color, dashes = colors.get(pair[0], ("0.85", "-"))
        label = f"from {pair[0]} ({NAMES[pair[0]]})" if pair[0] in colors else "from the others"
        axes.plot(
            np.linspace(0.0, 1.0, len(path["quality"])), path["quality"], color=color,
            linestyle=dashes, linewidth=1.1, zorder=2 if pair[0] in colors else 1,
            label=None if label in seen else label,
        )  # fmt: skip
        seen.add(label)
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("t")
    axes.set_ylabel("$Q_8$")
    axes.set_title(f"{kind} transfer", fontsize=11)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=9)
    return figure


# Fig. 10 ----------------------------------------------------------------------------------------


def fig10_piece(index: int, scale: Scale) -> dict[str, Any]:
    """Transfers from one model to all twelve, by every method."""
    source = list(MODELS)[index]
    grasp, _ = own_grasp(MODELS[source], scale)
    found: dict[str, Any] = {"seconds": {}}
    for method in METHODS:
        start = time.perf_counter()
        ends = [
            transfer(MODELS[source], grasp, target, method,
                     friction=scale.friction, edges=scale.edges)
            for target in MODELS.values()
        ]  # fmt: skip
        found["seconds"][method] = (time.perf_counter() - start) / len(ends)
        found[method] = [end.quality for end in ends]
        found[f"{method} evaluations"] = [end.evaluations for end in ends]
    return found


def fig10(pieces: Pieces, seconds: Seconds, scale: Scale) -> Outcome:
    """The gradient method against the naïve transfer, all 144 pairs."""
    found = pieces["fig10"]
    ends = {m: np.concatenate([piece[m] for piece in found]) for m in METHODS}
    most = {m: max(max(piece[f"{m} evaluations"]) for piece in found) for m in METHODS}
    beats = int((ends["gradient"] > ends["naive"]).sum())
    outcome = Outcome(series={m: ends[m].tolist() for m in METHODS})
    outcome.rows = [
        Row("gradient transfers that end force closure, of 144", "IV.D", "144",
            str(int((ends["gradient"] > 0.0).sum())), IN_KIND,
            bool((ends["gradient"] > 0.0).all())),
        Row("naïve transfers that end force closure, of 144", "IV.D", "fewer",
            str(int((ends["naive"] > 0.0).sum())), IN_KIND,
            bool((ends["naive"] > 0.0).sum() < 144)),
        Row("pairs in which the gradient method ends higher than the naïve transfer", "IV.D", "143",
            str(beats), IN_KIND, beats >= 140,
            "from g to g steps of fixed length jump across a kink; from h to f and from k to f the "
            "maximum that is followed sinks while the surface changes"),
        Row("pairs in which our ascent ends at least as high as the gradient method", "IV.D", "–",
            str(int((ends["ascent"] >= ends["gradient"]).sum())), BEYOND, None,
            f"with at most {most['ascent']:,} evaluations against {most['gradient']:,}; with the "
            "paper's finite differences it takes seven per step"),
        Row("mean final Q₈: naïve, gradient, ascent", "IV.D", "–",
            ", ".join(f"{ends[m].mean():.4f}" for m in METHODS), BEYOND, None),
    ]  # fmt: skip
    outcome.times = [
        (f"one {m} transfer", "–", f"{1e3 * np.mean([p['seconds'][m] for p in found]):.2f} ms")
        for m in METHODS
    ]
    outcome.pictures = {"": partial(_fig10_picture, ends)}
    return outcome


def _fig10_picture(ends: dict[str, Any]) -> Figure:
    figure = Figure(figsize=(7.2, 3.8), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    for method, (color, dashes) in (("gradient", LINES[0]), ("ascent", LINES[1])):
        better = np.sort(ends[method] - ends["naive"])
        axes.plot(
            np.arange(1, 145), better, color=color, linestyle=dashes, label=f"{method} − naïve"
        )
    axes.axhline(0.0, color="0.6", linewidth=0.8)
    axes.set_xlabel("transfers, sorted")
    axes.set_ylabel("difference of final $Q_8$")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False)
    return figure


# Fig. 11 ----------------------------------------------------------------------------------------


def fig11_piece(index: int, scale: Scale) -> dict[str, Any]:
    """Exhaustive search and the heuristic on ten random surfaces of revolution."""
    surfaces = sample_combinations([MODELS[name] for name in "abcd"], ROUND, seed=scale.seed)
    found: dict[str, Any] = {"brute": [], "heuristic": [], "ours": [], "seconds": {}}
    spent = {"brute": 0.0, "heuristic": 0.0, "ours": 0.0}
    for number in range(index * ROUND_PIECE, (index + 1) * ROUND_PIECE):
        surface = surfaces[number]
        options = {"friction": scale.friction, "edges": scale.edges}
        u, theta = sample_points(surface, ROUND_CONTACTS, seed=scale.seed + 1 + number)
        # The centre of mass is computed once, whoever asks first.
        _ = surface.center_of_mass
        clock = time.perf_counter()
        brute = best_grasps(surface, u, theta, threads=1, **options)
        spent["brute"] += time.perf_counter() - clock
        clock = time.perf_counter()
        heuristic = plane_grasp(surface, **options)
        spent["heuristic"] += time.perf_counter() - clock
        clock = time.perf_counter()
        ours = synthesize(surface, top=1, seed=scale.seed, **options)
        spent["ours"] += time.perf_counter() - clock
        found["brute"].append(brute[0].quality if brute else 0.0)
        found["heuristic"].append(heuristic.quality if heuristic else 0.0)
        found["ours"].append(ours[0].quality if ours else 0.0)
    found["seconds"] = {key: value / ROUND_PIECE for key, value in spent.items()}
    return found


def fig11(pieces: Pieces, seconds: Seconds, scale: Scale) -> Outcome:
    """Surfaces of revolution: the heuristic against exhaustive search."""
    found = pieces["fig11"]
    kinds = ("brute", "heuristic", "ours")
    values = {kind: np.concatenate([piece[kind] for piece in found]) for kind in kinds}
    mean = {kind: f"{v.mean():.4f} ± {v.std() / np.sqrt(len(v)):.4f}" for kind, v in values.items()}
    outcome = Outcome(series={kind: v.tolist() for kind, v in values.items()})
    outcome.rows = [
        Row("mean of the best Q₈ of C(100, 3) on 100 random surfaces", "IV.E", "0.2435",
            mean["brute"], IN_KIND, bool((values["brute"] > 0.0).all()),
            "the models are not the paper's"),
        Row("mean Q₈ of the heuristic with 450 evaluations", "IV.E", "0.2521", mean["heuristic"],
            IN_KIND, bool(values["heuristic"].mean() >= values["brute"].mean()),
            "must be at least that of exhaustive search"),
        Row("surfaces on which the heuristic's grasp is force closure, of 100", "IV.E", "100",
            str(int((values["heuristic"] > 0.0).sum())), IN_KIND,
            bool((values["heuristic"] > 0.0).all())),
        Row("mean Q₈ of our synthesis", "IV.E", "–", mean["ours"], BEYOND, None),
    ]  # fmt: skip
    spent = {kind: float(np.mean([piece["seconds"][kind] for piece in found])) for kind in kinds}
    outcome.times = [
        ("C(100, 3) = 161,700 evaluations, a surface", "250 s", f"{1e3 * spent['brute']:.2f} ms"),
        (
            "the heuristic, 450 evaluations, a surface",
            "0.89 s",
            f"{1e3 * spent['heuristic']:.2f} ms",
        ),
        ("our synthesis, a surface", "–", f"{1e3 * spent['ours']:.2f} ms"),
    ]
    labels = ("exhaustive, 100 contacts", "the heuristic", "our synthesis")
    outcome.pictures = {"": partial(_fig11_picture, [values[kind] for kind in kinds], labels)}
    return outcome


def _fig11_picture(values: Sequence[Any], labels: Sequence[str]) -> Figure:
    figure = Figure(figsize=(7.2, 3.6), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    bins = np.linspace(0.0, max(map(np.max, values)) * 1.02, 40)
    for found, label, (color, dashes) in zip(
        values, labels, (LINES[1], LINES[0], LINES[2]), strict=True
    ):
        numbers, _ = np.histogram(found, bins)
        axes.stairs(numbers, bins, color=color, linestyle=dashes, linewidth=1.8, label=label)
    axes.set_xlabel("$Q_8$ of the grasp found")
    axes.set_ylabel("surfaces of 100")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False)
    return figure


# Fig. 12 ----------------------------------------------------------------------------------------


def fig12_piece(index: int, scale: Scale) -> dict[str, Any]:
    """Synthesis by deformation against exhaustive search on one model."""
    surface = MODELS[UNEVEN[index]]
    options = {"friction": scale.friction, "edges": scale.edges}
    _ = surface.center_of_mass
    clock = time.perf_counter()
    _, brute = own_grasp(surface, scale)
    searched = time.perf_counter() - clock
    clock = time.perf_counter()
    flat = project(surface)
    start = plane_grasp(flat, **options)
    carried = 0.0
    evaluations = 450
    if start is not None:
        # N₁ = N₂ = 10, δ = 0.01, h = 1e-5, as in the paper.
        way = transfer(flat, start.grasp, surface, "gradient", surfaces=10, steps=10,
                       step_length=0.01, difference=1e-5, **options)  # fmt: skip
        carried, evaluations = way.quality, evaluations + way.evaluations
    deformed = time.perf_counter() - clock
    clock = time.perf_counter()
    ours = synthesize(surface, top=5, starts=STARTS, seed=scale.seed, **options)
    synthesised = time.perf_counter() - clock
    return {
        "brute": brute,
        "deformation": carried,
        "evaluations": evaluations,
        "ours": ours[0].quality if ours else 0.0,
        "seconds": {"brute": searched, "deformation": deformed, "ours": synthesised},
    }


def fig12(pieces: Pieces, seconds: Seconds, scale: Scale) -> Outcome:
    """Synthesis by deformation from a surface of revolution."""
    found = pieces["fig12"]
    kinds = ("brute", "deformation", "ours")
    values = {kind: np.array([piece[kind] for piece in found]) for kind in kinds}
    wins = int((values["ours"] >= values["brute"]).sum())
    outcome = Outcome(series={kind: v.tolist() for kind, v in values.items()} | {"models": UNEVEN})
    evaluations = max(piece["evaluations"] for piece in found)
    outcome.rows = [
        Row("models e–l on which deformation from π(S) ends force closure", "IV.E", "8 of 8",
            f"{int((values['deformation'] > 0.0).sum())} of 8", IN_KIND,
            bool((values["deformation"] > 0.0).all()),
            f"the paper's parameters, {evaluations:,} evaluations"),
        Row("mean Q₈: best of C(200, 3), deformation", "IV.E", "deformation lower",
            f"{values['brute'].mean():.4f}, {values['deformation'].mean():.4f}", IN_KIND,
            bool(values["deformation"].mean() < values["brute"].mean()),
            "on these models, which are not the paper's, deformation finds better grasps"),
        Row("models on which our synthesis is at least the best of C(200, 3)", "IV.E", "–",
            f"{wins} of 8", BEYOND, None,
            f"mean Q₈ {values['ours'].mean():.4f}, {STARTS} starts"),
    ]  # fmt: skip
    spent = {kind: float(np.mean([piece["seconds"][kind] for piece in found])) for kind in kinds}
    outcome.times = [
        ("best of C(200, 3), a surface", "31 minutes", f"{1e3 * spent['brute']:.1f} ms"),
        ("deformation from π(S), a surface", "4 s", f"{1e3 * spent['deformation']:.2f} ms"),
        (f"our synthesis with {STARTS} starts, a surface", "–", f"{1e3 * spent['ours']:.2f} ms"),
    ]
    outcome.pictures = {"": partial(_fig12_picture, values)}
    return outcome


def _fig12_picture(values: dict[str, Any]) -> Figure:
    figure = Figure(figsize=(7.2, 3.6), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    labels = ("best of C(200, 3)", "deformation from π(S), the paper's", "our synthesis")
    for k, (kind, label, color) in enumerate(
        zip(values, labels, ("#0072B2", "#D55E00", "#009E73"), strict=True)
    ):
        axes.bar(np.arange(8) + 0.27 * (k - 1), values[kind], 0.25, color=color, label=label)
    axes.set_xticks(range(8), [f"{name}\n{NAMES[name]}" for name in UNEVEN], fontsize=8)
    axes.set_ylabel("$Q_8$")
    axes.set_ylim(0.0, 0.5)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=9, ncols=3)
    return figure


# Pictures only ----------------------------------------------------------------------------------


def fig1(pieces: Pieces, seconds: Seconds, scale: Scale) -> Outcome:
    """A simplex of shapes."""
    corners = [MODELS[name] for name in CORNERS]
    labels = [f"{name} ({NAMES[name]})" for name in CORNERS]
    return Outcome(
        pictures={"": partial(plot_simplex, corners, labels, samples=10, seed=scale.seed)}
    )


def fig2(pieces: Pieces, seconds: Seconds, scale: Scale) -> Outcome:
    """The twelve models."""
    labels = [f"{name}  {NAMES[name]}" for name in MODELS]
    return Outcome(pictures={"": partial(_gallery, list(MODELS.values()), labels)})


def fig3(pieces: Pieces, seconds: Seconds, scale: Scale) -> Outcome:
    """Random shapes between the models."""
    surfaces = sample_combinations(list(MODELS.values()), 12, seed=scale.seed, concentration=0.3)
    return Outcome(pictures={"": partial(_gallery, surfaces, [""] * 12)})


def fig4(pieces: Pieces, seconds: Seconds, scale: Scale) -> Outcome:
    """A curve in the Grasp Moduli Space."""
    first, last = (MODELS[name] for name in ("a", "j"))
    start, end = (first, own_grasp(first, scale)[0]), (last, own_grasp(last, scale)[0])
    return Outcome(pictures={"": partial(plot_path, start, end)})


def _gallery(surfaces: Sequence[Surface], labels: Sequence[str]) -> Figure:
    figure = Figure(figsize=(9.0, 4.4), dpi=110)
    camera = Camera(0.6, ELEVATION)
    for index, (surface, label) in enumerate(zip(surfaces, labels, strict=True)):
        row, column = divmod(index, 6)
        axes = figure.add_axes((column / 6, 0.52 - 0.5 * row, 1 / 6, 0.44))
        scene = Scene()
        add_body(scene, camera, surface)
        scene.draw(axes)
        finish(axes)
        axes.set_title(label, fontsize=9, y=-0.08)
    return figure
