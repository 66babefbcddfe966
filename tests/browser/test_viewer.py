"""The viewer, in a real browser."""

import io
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import sync_playwright

import graspmoduli as gm
from conftest import ROOT
from graspmoduli.objects.fitting import fit_object
from graspmoduli.objects.reading import read
from graspmoduli.viewing.browser import pointing
from graspmoduli.viewing.browser.grasp_page import GraspPage
from graspmoduli.viewing.browser.server import open_server
from graspmoduli.viewing.browser.shapes_page import ShapePage

OBJECT = ROOT / "examples" / "objects" / "yogurt_bottle.ply"
#: Software rendering, and nothing fetched behind our back.
ARGUMENTS = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
]
#: Where a page may get something from: itself.
ITSELF = ("http://127.0.0.1", "ws://127.0.0.1", "data:", "blob:", "file:")


@pytest.fixture(scope="module")
def browser():
    with sync_playwright() as playwright:
        path = shutil.which("chromium")
        assert path, "the browser tests need chromium (Debian: apt install chromium)"
        chromium = playwright.chromium.launch(executable_path=path, args=ARGUMENTS)
        yield chromium
        chromium.close()


@pytest.fixture(scope="module")
def found():
    thing = read(OBJECT)
    fit = fit_object(thing)
    return thing, fit, fit.synthesize(top=3)


@pytest.fixture
def served(found):
    """A server and the pages that it made, in the order of their browsers."""
    server = open_server(0)
    pages = []

    @server.on_client_connect
    def _(client):
        pages.append(GraspPage(client, *found, 1.0, 8, "bottle"))

    yield f"http://127.0.0.1:{server.get_port()}", pages
    server.stop()


class Window:
    """A page with what went wrong on it."""

    def __init__(self, browser, address, width=1280):
        self.errors, self.outside = [], []
        self.page = browser.new_page(viewport={"width": width, "height": 800})
        self.page.on("console", lambda m: m.type == "error" and self.errors.append(m.text))
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", self._request)
        self.page.goto(address)

    def _request(self, request):
        if not request.url.startswith(
            ("http://127.0.0.1", "ws://127.0.0.1", "data:", "blob:", "file:")
        ):
            self.outside.append(request.url)

    def quality(self):
        return float(self.page.locator("[data-quality]").first.inner_text())

    def canvas(self):
        """The box and the colours of the scene."""
        box = self.page.locator("canvas").first.bounding_box()
        image = Image.open(io.BytesIO(self.page.screenshot())).convert("RGB")
        pixels = np.asarray(image).astype(int)
        x, y = int(box["x"]), int(box["y"])
        return box, pixels[y : y + int(box["height"]), x : x + int(box["width"])]

    def drawn(self):
        """Share of the middle of the scene that is not background."""
        _, pixels = self.canvas()
        h, w, _ = pixels.shape
        middle = pixels[h // 4 : 3 * h // 4, w // 4 : 3 * w // 4]
        return float((np.abs(middle - 255).max(-1) > 20).mean())


def wait(condition, seconds=60):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.2)


def ready(window):
    window.page.wait_for_selector("[data-quality]", timeout=60_000)
    wait(lambda: window.drawn() > 0.05)
    return window


def on_screen(page, window, point):
    """Where a point of the scene is on the browser's page."""
    camera = page.client.camera
    eye, target = np.asarray(camera.position), np.asarray(camera.look_at)
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    off = np.asarray(point) - eye
    box, _ = window.canvas()
    size = 0.5 * box["height"] / np.tan(0.5 * camera.fov) / (off @ forward)
    return (
        box["x"] + 0.5 * box["width"] + size * (off @ right),
        box["y"] + 0.5 * box["height"] - size * (off @ up),
    )


def test_an_object_is_drawn_and_nothing_is_fetched(browser, served, found):
    address, _ = served
    window = ready(Window(browser, address))
    assert window.quality() == pytest.approx(found[2][0].quality, abs=1e-4)
    assert window.errors == []
    assert window.outside == []
    window.page.close()


def test_a_slider_changes_the_quality(browser, served, found):
    address, pages = served
    window = ready(Window(browser, address))
    before = window.quality()
    fields = window.page.locator("input[type=text]")
    # The numbers beside the sliders, in their order: rank, friction, edges.
    numbers = [fields.nth(k) for k in range(fields.count()) if fields.nth(k).input_value() == "1"]
    friction = numbers[1]
    friction.fill("0.5")
    friction.press("Enter")
    friction.blur()
    wait(lambda: window.quality() != before)
    wanted = gm.quality(found[2][0], friction=0.5)
    wait(lambda: window.quality() == pytest.approx(wanted, abs=1e-4))
    assert pages[-1].friction.value == 0.5
    window.page.close()


def test_a_drag_moves_a_contact_along_the_surface(browser, served):
    address, pages = served
    window = ready(Window(browser, address))
    page = pages[-1]
    # On the fitted surface, where a drag moves contacts.
    page.show(page.grasp)
    eye = np.asarray(page.client.camera.position)
    placed = gm.place(page.surface, page.grasp)
    # The contact that faces the eye most.
    facing = ((eye - placed.contacts) * -placed.normals).sum(1)
    index = int(facing.argmax())
    before, value = page.grasp, window.quality()
    x, y = on_screen(page, window, placed.contacts[index])
    mouse = window.page.mouse
    mouse.move(x, y)
    mouse.down()
    for step in range(1, 9):
        mouse.move(x, y - 6 * step)
        time.sleep(0.1)
    mouse.up()
    wait(lambda: page.grasp.u[index] > before.u[index] + 0.01)
    wait(
        lambda: window.quality() == pytest.approx(page.fit.in_object(page.grasp).quality, abs=1e-4)
    )
    after = page.grasp
    # That finger went up, the others stayed.
    assert after.u[index] > before.u[index] + 0.01
    others = [k for k in range(3) if k != index]
    np.testing.assert_array_equal(after.u[others], before.u[others])
    assert window.quality() != value
    np.testing.assert_allclose(
        page.spheres[index].position, gm.place(page.surface, after).contacts[index], atol=1e-6
    )
    window.page.close()


def test_two_browsers_do_not_disturb_each_other(browser, served, found):
    address, pages = served
    first = ready(Window(browser, address))
    second = ready(Window(browser, address))
    quality = second.quality()
    pages[0].rank.value = 2
    wait(lambda: first.quality() == pytest.approx(found[2][1].quality, abs=1e-4))
    assert second.quality() == quality
    first.page.close()
    pages[1].friction.value = 0.7
    wait(lambda: second.quality() != quality)
    second.page.close()
    # And the server goes on.
    third = ready(Window(browser, address, width=700))
    assert third.errors == []
    third.page.close()


def test_the_ascent_climbs(browser, served, found):
    address, pages = served
    window = ready(Window(browser, address))
    page = pages[-1]
    best = found[1].on_surface(found[2][0])
    worse = gm.Grasp(0.9 * best.u + 0.05, best.theta + np.array([0.0, 0.3, 0.0]))
    page.show(worse)
    start = found[1].in_object(worse).quality
    assert 0.0 < start < 0.8 * found[2][0].quality
    wait(lambda: window.quality() == pytest.approx(start, abs=1e-4))
    window.page.get_by_role("button", name="Improve this grasp").click()
    wait(lambda: window.quality() > 1.1 * start)
    window.page.close()


def test_the_ascent_never_ends_lower_than_it_starts(served, browser, found):
    address, pages = served
    window = ready(Window(browser, address))
    page, fit = pages[-1], found[1]
    for ranked in found[2]:
        for friction in (0.3, 1.0):
            page.friction.value = friction
            grasp = fit.on_surface(ranked)
            # As it was offered, on the mesh, and from the fitted surface.
            for offered in (ranked, None):
                page.show(grasp, offered)
                start = page._worth(grasp, offered)
                page.climb()
                assert page._worth(page.grasp, page.offered) >= start
    window.page.close()


@pytest.mark.parametrize(("friction", "edges"), [(0.05, 64), (0.77, 8), (3.3, 3)])
def test_any_friction_and_edges_are_those_that_are_asked_for(browser, found, friction, edges):
    server = open_server(0)
    pages = []

    @server.on_client_connect
    def _(client):
        pages.append(GraspPage(client, *found, friction, edges, "bottle"))

    window = Window(browser, f"http://127.0.0.1:{server.get_port()}")
    window.page.wait_for_selector("[data-quality]", timeout=60_000)
    assert (pages[0].friction.value, pages[0].edges.value) == (friction, edges)
    wanted = gm.quality(found[2][0], friction=friction, edges=edges)
    wait(lambda: window.quality() == pytest.approx(wanted, abs=1e-4))
    assert window.errors == []
    window.page.close()
    server.stop()


def test_the_space_of_shapes(browser):
    server = open_server(0)
    pages = []

    @server.on_client_connect
    def _(client):
        pages.append(ShapePage(client, {}))

    window = Window(browser, f"http://127.0.0.1:{server.get_port()}")
    window.page.wait_for_selector("[data-quality]", timeout=60_000)
    before = window.quality()
    wait(lambda: window.drawn() > 0.01)
    pages[0].move(np.array([0.1, 0.8, 0.1]))
    wait(lambda: window.quality() != before)
    pages[0].way.value = "ascent"
    naive = window.quality()
    wait(lambda: window.quality() > naive)
    assert window.errors == []
    assert window.outside == []
    window.page.close()
    server.stop()


def test_a_saved_page_opens_without_a_server(browser, tmp_path):
    page, picture = tmp_path / "bottle.html", tmp_path / "bottle.png"
    command = [sys.executable, "-m", "graspmoduli", "view", str(OBJECT)]
    command += ["--html", str(page), "--picture", str(picture)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    assert picture.stat().st_size > 10_000
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bottle.html", "bottle.png"]
    window = Window(browser, page.as_uri())
    wait(lambda: window.page.locator("canvas").count() > 0 and window.drawn() > 0.05)
    assert window.errors == []
    assert window.outside == []
    window.page.close()


def test_the_command_serves_an_own_object_among_the_shapes(browser):
    command = [sys.executable, "-m", "graspmoduli", "view", str(OBJECT), "--shapes", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        line = process.stdout.readline()
        assert line.startswith("open http://127.0.0.1:")
        window = Window(browser, line.split()[1])
        window.page.wait_for_selector("[data-quality]", timeout=60_000)
        values = [field.input_value() for field in window.page.locator("input").all()]
        assert "yogurt_bottle.ply" in values
        assert window.quality() > 0.0
        assert window.errors == []
        window.page.close()
        process.terminate()


def run(*arguments):
    command = [sys.executable, "-m", "graspmoduli", "view", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


def test_a_wrong_path_is_one_sentence(tmp_path):
    result = run(str(tmp_path / "none.ply"), "--port", "0")
    assert result.returncode == 2
    assert result.stderr.startswith("graspmoduli: ")
    assert "none.ply" in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_busy_port_is_reported_with_the_way_out():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        result = run(str(OBJECT), "--port", str(port))
    assert result.returncode == 2
    assert result.stderr == (
        f"graspmoduli: port must be free, got {port} in use; "
        "name another with --port, or 0 for any\n"
    )


def test_html_needs_an_object(tmp_path):
    result = run("--html", str(tmp_path / "page.html"))
    assert result.returncode == 2
    assert "OBJECT must be given" in result.stderr
    assert not list(Path(tmp_path).iterdir())


def test_barycentric_coordinates_stay_in_the_triangle():
    rng = np.random.default_rng(3)
    for weights in rng.dirichlet(np.ones(3), 20):
        np.testing.assert_allclose(
            pointing.barycentric(weights @ pointing.TRIANGLE), weights, atol=1e-12
        )
    for point in 5.0 * rng.normal(size=(50, 3)) * [1, 0, 1]:
        weights = pointing.barycentric(point)
        assert (weights >= 0.0).all()
        assert weights.sum() == pytest.approx(1.0)


def test_a_ray_meets_the_surface_where_it_is():
    surface = gm.shapes.MODELS["a"]
    rng = np.random.default_rng(4)
    eye = np.array([2.0, -2.0, 0.6])
    for u, theta in zip(0.1 + 0.8 * rng.random(40), 2 * np.pi * rng.random(40), strict=True):
        point, normal = surface.points(u, theta), surface.normals(u, theta)
        if (eye - point) @ -normal < 0.8:
            continue
        found = surface.points(*pointing.under_pointer(surface, eye, point))
        assert np.linalg.norm(found - point) < 0.02
