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
from axe_playwright_python.sync_playwright import Axe
from PIL import Image
from playwright.sync_api import sync_playwright

import graspmoduli as gm
from conftest import ROOT
from graspmoduli.cli.given import grasps_of, read_report
from graspmoduli.cli.report import report
from graspmoduli.objects.fitting import fit_object
from graspmoduli.objects.reading import read
from graspmoduli.viewing import pointing
from graspmoduli.viewing.browser import triangle
from graspmoduli.viewing.browser.grasp_page import Shown
from graspmoduli.viewing.browser.server import add_pages, open_server
from graspmoduli.viewing.browser.shapes_page import ShapePage
from graspmoduli.viewing.held import Hand
from graspmoduli.viewing.page import page_of

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


def shown_of(found, **options):
    hand = Hand(**options)
    return Shown(*found, hand, "bottle.ply", report=report_of(found))


def report_of(found):
    return lambda grasps, hand: report("bottle.ply", *found[:2], grasps, *hand[:2], hand.norm)


@pytest.fixture
def served(found):
    """A server and the pages that it made, in the order of their browsers."""
    server = open_server(0)
    pages = add_pages(server, shown_of(found))
    yield f"http://127.0.0.1:{server.get_port()}", pages
    server.stop()


class Window:
    """A page with what went wrong on it."""

    def __init__(self, browser, address, width=1280, height=800):
        self.errors, self.outside = [], []
        self.page = browser.new_page(viewport={"width": width, "height": height})
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


def test_a_drag_moves_a_fingertip_along_the_object(browser, served, found):
    address, pages = served
    window = ready(Window(browser, address))
    page, fit = pages[-1], found[1]
    settled(page)
    before, value = page.held, window.quality()
    eye = np.asarray(page.client.camera.position)
    balls = np.array([ball.position for ball in page.balls])
    normals = before.normals @ fit.pose[:3, :3]
    # The contact that faces the eye most.
    index = int(((eye - balls) * -normals).sum(1).argmax())
    x, y = on_screen(page, window, balls[index])
    drag(window, (x, y), (x, y - 60))
    wait(lambda: not np.array_equal(page.held.contacts, before.contacts))
    wait(
        lambda: window.quality() == pytest.approx(page.touch.worth(page.held, page.hand), abs=1e-4)
    )
    after = page.held
    others = [k for k in range(3) if k != index]
    np.testing.assert_array_equal(after.contacts[others], before.contacts[others])
    # That finger is on the mesh, higher up.
    local = np.stack(
        [(one.contacts[index] - fit.pose[:3, 3]) @ fit.pose[:3, :3] for one in (before, after)]
    )
    assert local[1, 2] > local[0, 2]
    near = fit.mesh.core.nearest(fit.mesh.local(after.contacts))
    assert np.abs(near - fit.mesh.local(after.contacts)).max() < 1e-6
    assert window.quality() != value
    assert "modified" in window.page.locator("[data-modified]").inner_text()
    # One undo takes the whole drag back.
    window.page.get_by_role("button", name="Undo").click()
    wait(lambda: window.quality() == pytest.approx(value, abs=1e-4))
    assert "modified" not in window.page.locator("[data-modified]").inner_text()
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


def test_improve_helps_at_once_and_can_be_undone(browser, served, found):
    address, pages = served
    window = ready(Window(browser, address))
    page = pages[-1]
    worse = page.held.with_finger(1, page.touch.put(*page.touch.under(*beside(page, 1))))
    page.change(worse)
    start = page.touch.worth(worse, page.hand)
    wait(lambda: window.quality() == pytest.approx(start, abs=1e-4))
    began = time.monotonic()
    window.page.get_by_role("button", name="Improve this grasp").click()
    wait(lambda: window.quality() > start)
    assert time.monotonic() - began < 3.0
    window.page.get_by_role("button", name="Undo").click()
    wait(lambda: window.quality() == pytest.approx(start, abs=1e-4))
    window.page.get_by_role("button", name="Revert").click()
    wait(lambda: window.quality() == pytest.approx(found[2][0].quality, abs=1e-4))
    window.page.close()


def beside(page, index):
    """Where a finger is put a good way beside its contact."""
    finger = page.held.fingers[index]
    side = np.cross(finger.normal, [0.3, 0.5, 0.8])
    start = finger.point - 2.0 * page.touch.size * finger.normal
    return start, finger.point + 0.15 * page.touch.size * side


def test_what_follows_friction(browser, served, found):
    """Text, ranks, colours and their key."""
    address, pages = served
    window = ready(Window(browser, address))
    page = pages[-1]
    page.colors.mode.value = "Q with finger 1 there"
    wait(lambda: page.colors.on)
    first = page.colors.drawn
    key = page.colors.key.content
    page.friction.value = 0.4
    wanted = [gm.quality(one, friction=0.4) for one in found[2]]
    cells = window.page.locator("[data-ranking] tbody tr td:nth-child(3)")
    wait(
        lambda: (
            [cell == f"{q:.4f}" for cell, q in zip(cells.all_inner_texts(), wanted, strict=True)]
            == [True] * 3
        )
    )
    wait(lambda: page.colors.key.content != key)
    values = page.touch.what_if(page.held, 0, page.hand)
    assert f"{values.max():.3f}" in page.colors.key.content
    wait(lambda: page.colors.drawn is not first)
    window.page.close()


def test_a_contact_that_no_finger_makes_is_marked(browser, served):
    address, pages = served
    window = ready(Window(browser, address))
    page = pages[-1]
    assert window.page.locator("[data-truth]").get_attribute("data-truth") == "good"
    finger = page.held.fingers[0]
    lifted = page.touch.judge(finger.point - 0.1 * page.touch.size * finger.normal, finger.normal)
    page.change(page.held.with_finger(0, lifted))
    wait(lambda: window.page.locator("[data-truth]").get_attribute("data-truth") == "bad")
    assert "finger 1: it is off the object" in window.page.locator("[data-truth]").inner_text()
    assert page.cages[0].visible
    assert not page.cages[1].visible
    window.page.close()


def test_a_key_moves_a_finger(browser, served):
    address, pages = served
    window = ready(Window(browser, address))
    page = pages[-1]
    settled(page)
    before = page.held
    window.page.keyboard.press("2")
    wait(lambda: page.chosen == 1)
    window.page.keyboard.press("i")
    wait(lambda: not np.array_equal(page.held.contacts[1], before.contacts[1]))
    moved = page.held.contacts
    np.testing.assert_array_equal(moved[[0, 2]], before.contacts[[0, 2]])
    assert 0.0 < np.linalg.norm(moved[1] - before.contacts[1]) < 0.05 * page.touch.size
    window.page.keyboard.press("u")
    wait(lambda: np.array_equal(page.held.contacts, before.contacts))
    window.page.close()


def test_what_is_saved_is_read_back(browser, served, tmp_path):
    address, pages = served
    window = ready(Window(browser, address))
    page = pages[-1]
    page.change(page.held.with_finger(1, page.touch.put(*page.touch.under(*beside(page, 1)))))
    window.page.get_by_role("tab", name="Save").click()
    cells = window.page.locator("[data-contacts] tbody tr").nth(1).inner_text().split()
    shown = page.held.contacts[1]
    np.testing.assert_allclose([float(cell) for cell in cells[-3:]], shown, atol=0.01)
    with window.page.expect_download() as waiting:
        window.page.get_by_role("button", name="Save JSON").click()
    path = tmp_path / "saved.json"
    waiting.value.save_as(path)
    found = read_report(path)
    again = grasps_of(found, path, page.fit, page.hand)
    np.testing.assert_array_equal(again[0].contacts, page.held.contacts)
    assert again[0].quality == page.touch.worth(page.held, page.hand)
    assert len(again) == 4
    with window.page.expect_download() as waiting:
        window.page.get_by_role("button", name="Save PNG").click()
    picture = tmp_path / "saved.png"
    waiting.value.save_as(picture)
    pixels = np.asarray(Image.open(picture).convert("RGB")).astype(int)
    assert (np.abs(pixels - 255).max(-1) > 20).mean() > 0.03
    window.page.close()


def test_a_pull_is_answered_until_the_object_slips(browser, served):
    address, pages = served
    window = ready(Window(browser, address))
    page = pages[-1]
    window.page.get_by_role("tab", name="Pull").click()
    page.pull.shown.value = True
    page.pull.squeeze.value = 100.0
    verdict = window.page.locator("[data-pull]")
    wait(lambda: "It holds" in verdict.inner_text())
    page.pull.payload.value = 5.0
    page.pull.squeeze.value = 1.0
    wait(lambda: "It slips" in verdict.inner_text())
    window.page.close()


@pytest.mark.parametrize(("width", "height"), [(1280, 800), (390, 844)])
def test_the_first_look_shows_all_fingers(browser, served, width, height):
    """Within the picture, not under the panel, and Q above it."""
    address, pages = served
    window = Window(browser, address, width, height)
    ready(window)
    page = pages[-1]
    settled(page)
    sheet = 0.42 * height if width < 576 else 0.0
    box, _ = window.canvas()
    for rank in (1, 2, 3):
        page.rank.value = rank
        settled(page)
        for ball in page.balls:
            x, y = on_screen(page, window, ball.position)
            assert 0.0 < x < box["width"]
            assert 0.0 < y < height - sheet
    state = window.page.locator("#gm-state")
    assert f"{window.quality():.4f}" in state.inner_text()
    assert "true on the object" in state.inner_text()
    window.page.close()


def test_every_control_has_a_name_and_the_page_a_title(browser, served):
    address, _ = served
    window = ready(Window(browser, address))
    assert window.page.title() == "bottle.ply – graspmoduli"
    for tab in ("Grasp", "See", "Pull", "Save"):
        window.page.get_by_role("tab", name=tab).click()
        time.sleep(0.5)
        nameless = window.page.evaluate(
            """() => [...document.querySelectorAll("input, [role=slider], button")]
                .filter((e) => e.offsetParent && !e.getAttribute("aria-label")
                    && !e.getAttribute("aria-labelledby") && !e.innerText.trim()
                    && !(e.labels && e.labels.length)).map((e) => e.outerHTML)"""
        )
        assert nameless == []
    window.page.close()


def serious(window):
    """What axe finds that keeps people out."""
    found = Axe().run(window.page).response["violations"]
    return [
        (one["id"], [node["html"][:200] for node in one["nodes"]])
        for one in found
        if one["impact"] in ("serious", "critical")
    ]


def test_nothing_keeps_people_out(browser, served, found, tmp_path):
    address, _ = served
    window = ready(Window(browser, address))
    # viser's own word about slow drawing is not ours, and goes by itself.
    hide = (
        "[...document.querySelectorAll('.mantine-Notification-root')].forEach(e => e.hidden = true)"
    )
    for tab in ("Grasp", "See", "Pull", "Save"):
        window.page.get_by_role("tab", name=tab).click()
        time.sleep(0.5)
        window.page.evaluate(f"() => {hide}")
        assert serious(window) == []
    window.page.close()
    path = tmp_path / "bottle.html"
    path.write_text(page_of(*found, Hand(), "bottle.ply"))
    for scheme in ("light", "dark"):
        saved = Window(browser, path.as_uri())
        saved.page.emulate_media(color_scheme=scheme)
        assert serious(saved) == []
        saved.page.close()


def settled(page):
    """The camera has come to rest."""

    def still():
        before = np.array(page.client.camera.position)
        time.sleep(0.6)
        return np.array_equal(before, page.client.camera.position)

    wait(still)


def drag(window, start, end):
    mouse = window.page.mouse
    mouse.move(*start)
    mouse.down()
    for share in np.linspace(0.0, 1.0, 9)[1:]:
        mouse.move(*(np.array(start) + share * (np.array(end) - start)))
        time.sleep(0.1)
    mouse.up()


@pytest.mark.parametrize(("friction", "edges"), [(0.05, 64), (0.77, 8), (3.3, 3)])
def test_any_friction_and_edges_are_those_that_are_asked_for(browser, found, friction, edges):
    server = open_server(0)
    pages = add_pages(server, shown_of(found, friction=friction, edges=edges))

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
    pages[0].way.value = "climbing where it arrives (ascent)"
    naive = window.quality()
    wait(lambda: window.quality() > naive)
    # The triangle has a key, and the window a title.
    wait(lambda: "In the triangle" in pages[0].key.content)
    assert window.page.title() == "the space of shapes – graspmoduli"
    assert pages[0].chart.scales["y"].get("range")[1] > window.quality()
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
    assert window.page.title() == "yogurt_bottle.ply – graspmoduli"
    # All grasps, by the slider; the sentence that explains Q, and a legend.
    fit = gm.fit(OBJECT)
    slider = window.page.get_by_role("slider")
    for rank, grasp in enumerate(fit.synthesize(), 1):
        slider.fill(str(rank))
        assert window.quality() == pytest.approx(grasp.quality, abs=1e-4)
        assert f"{rank} of 5" in window.page.locator("output").inner_text()
    text = window.page.locator("aside").inner_text()
    assert "is the largest disturbance" in text
    assert "friction cone" in text
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
            triangle.barycentric(weights @ triangle.TRIANGLE), weights, atol=1e-12
        )
    for point in 5.0 * rng.normal(size=(50, 3)) * [1, 0, 1]:
        weights = triangle.barycentric(point)
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
