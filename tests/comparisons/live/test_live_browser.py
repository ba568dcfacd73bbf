"""The page of `cgla live` in a real browser: dragged by mouse, finger and keyboard, at random too."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from live_page import ANSWERED, NEEDS_BROWSER, SETTLED, browser, draft, drag, faults, number, one, opened, served, until
from pyproj import Geod
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.actions.action_builder import ActionBuilder
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.remote.webdriver import WebDriver
from strategies import examples

from cgla_graph.comparisons.live.server import LiveServer
from cgla_graph.scenarios.scenario import load_scenario, open_table

pytestmark = [pytest.mark.slow, NEEDS_BROWSER]
#: A drag of a handle to a place, and an action after it.
Drag = tuple[float, tuple[float, float], str | None]


@pytest.fixture(scope="module")
def chromium() -> Iterator[WebDriver]:
    with browser() as driver:
        yield driver


@pytest.fixture(scope="module")
def server() -> Iterator[LiveServer]:
    with served("paper") as found:
        yield found


@pytest.fixture
def page(chromium: WebDriver, server: LiveServer) -> WebDriver:
    return opened(chromium, server.url)


def test_a_dragged_threat_moves_path_bound_and_tube(page: WebDriver) -> None:
    before = {name: one(page, name).text for name in ("#cost", "#bound")}
    tube, path = (one(page, f"#map .{name}").get_attribute("d") for name in ("tube", "path"))
    assert number(page, "#gap") <= 0.2
    node = page.find_elements(By.CSS_SELECTOR, "[data-handle=threat]")[1]
    drag(page, node, -90, -90)
    until(page, SETTLED)
    assert {name: one(page, name).text for name in ("#cost", "#bound")} != before
    assert one(page, "#map .tube").get_attribute("d") != tube
    assert one(page, "#map .path").get_attribute("d") != path
    assert number(page, "#bound") <= number(page, "#cost")
    was, now = load_scenario("paper").problem.field.threats[1], draft(page)["threats"][1]
    assert now["x"] < was.x - 0.05
    assert now["y"] > was.y + 0.05
    # one drag is one step back, and one forth
    one(page, "#undo").click()
    until(page, SETTLED)
    assert draft(page)["threats"][1]["x"] == was.x
    assert {name: one(page, name).text for name in ("#cost", "#bound")} == before
    assert not one(page, "#undo").is_enabled()
    page.find_element(By.TAG_NAME, "body").send_keys(Keys.CONTROL + Keys.SHIFT + "z")
    assert draft(page)["threats"][1] == now
    assert faults(page) == []


def test_the_keyboard_does_all_that_a_mouse_does(page: WebDriver) -> None:
    for _ in range(30):
        ActionChains(page).send_keys(Keys.TAB).perform()
        if page.execute_script("return document.activeElement.dataset.handle") == "threat":
            break
    before = draft(page)["threats"][0]
    ActionChains(page).send_keys(Keys.ARROW_RIGHT, Keys.ARROW_UP, "+").perform()
    until(page, SETTLED)
    after = draft(page)["threats"][0]
    assert (after["x"], after["y"]) == pytest.approx((before["x"] + 0.01, before["y"] + 0.01))
    assert after["spread"] == pytest.approx(1.05 * before["spread"], rel=1e-3)
    label = page.execute_script("return document.activeElement.getAttribute('aria-label')")
    assert re.fullmatch(r"threat 1 at 0\.61\d*, 0\.51\d*; spread [\d.]+, peak 1\.00", label)
    until(page, lambda: "gap at most" in str(one(page, "#said").get_attribute("textContent")))
    assert one(page, "#said").get_attribute("aria-live") == "polite"
    ActionChains(page).send_keys(Keys.DELETE).perform()
    until(page, ANSWERED)
    assert len(draft(page)["threats"]) == 9
    nameless = page.execute_script(
        "return [...document.querySelectorAll('button, select, input, [role=button]')].filter(node => "
        "!node.textContent.trim() && !node.getAttribute('aria-label') && !node.labels?.length).map(n => n.outerHTML)"
    )
    assert nameless == []
    assert faults(page) == []


def test_areas_and_their_corners_are_dragged_and_saved(
    chromium: WebDriver, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with served("paper") as server:
        page = opened(chromium, server.url)
        one(page, "#add-area").click()
        until(page, ANSWERED)
        first = draft(page)["areas"][0]
        drag(page, one(page, "[data-handle=area]"), -60, 40)
        drag(page, page.find_elements(By.CSS_SELECTOR, "[data-handle=corner]")[2], 40, -40)
        until(page, ANSWERED)
        area = draft(page)["areas"][0]
        assert all(now[0] < was[0] for now, was in zip(area[:2], first[:2], strict=True))
        one(page, "#add-corner").click()
        one(page, "#k-number").send_keys(Keys.CONTROL, "a", Keys.NULL, "4", Keys.TAB)
        until(page, SETTLED)
        one(page, "#save button[type=submit]").click()
        until(page, lambda: one(page, "#saved").text)
        file = tmp_path / "paper-live.toml"
        assert str(file) in one(page, "#saved").text
        problem = load_scenario(file).problem
        assert problem.k == 4.0
        assert len(draft(page)["areas"][0]) == 5
        assert problem.no_fly is not None
        # what another one wrote is replaced on demand only
        (tmp_path / "other.toml").write_text("")
        field = one(page, "#file")
        field.clear()
        field.send_keys("other.toml", Keys.ENTER)
        until(page, lambda: one(page, "#replace").is_displayed())
        assert "other.toml is there already" in one(page, "#saved").text
        one(page, "#replace").click()
        until(page, lambda: "Saved as" in one(page, "#saved").text)
        # refusals are answers with a status of their own, which Chromium logs
        assert [line for line in faults(page) if "409" not in line] == []


def test_solvers_stand_side_by_side_and_where_none_has_a_path_a_sentence_says_why(page: WebDriver) -> None:
    for name in ("cgla", "straight-line", "prm-star"):
        page.execute_script(
            "const node = document.querySelector('#solver'); node.value = arguments[0];"
            "node.dispatchEvent(new Event('change'));",
            name,
        )
    until(page, "return live.state.others.every(one => one.answer && one.number === live.state.number)")
    assert len(page.find_elements(By.CSS_SELECTOR, "#map .path")) == 4
    gaps = [row.text for row in page.find_elements(By.CSS_SELECTOR, "#paths tbody td:nth-child(3)")]
    assert all(gap.startswith("+") for gap in gaps)
    # the start is dragged out of the map
    drag(page, one(page, "[data-handle=start]"), -100, 0)
    until(page, SETTLED)
    assert re.fullmatch(r"start .* is outside the bounds .*", one(page, "#problem").text)
    assert one(page, "#problem").get_attribute("role") == "alert"
    assert page.find_elements(By.CSS_SELECTOR, "#map .tube") == []
    one(page, "#undo").click()
    until(page, SETTLED)
    assert not one(page, "#problem").is_displayed()
    assert faults(page) == []


def test_on_a_phone_a_finger_drags_and_nothing_is_wider_than_the_page(chromium: WebDriver, server: LiveServer) -> None:
    page = opened(chromium, server.url, width=390, phone=True)
    try:
        assert page.execute_script("return document.documentElement.scrollWidth <= innerWidth")
        before = draft(page)["goal"]
        box = page.execute_script(
            "return document.querySelector('[data-handle=goal]').getBoundingClientRect().toJSON()"
        )
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        send = page.execute_cdp_cmd
        send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [{"x": x, "y": y}]})
        for step in range(1, 9):
            send(
                "Input.dispatchTouchEvent",
                {"type": "touchMove", "touchPoints": [{"x": x - 6 * step, "y": y + 8 * step}]},
            )
        send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        until(page, SETTLED)
        after = draft(page)["goal"]
        assert after[0] < before[0] - 0.08
        assert after[1] < before[1] - 0.1
        assert page.execute_script("return scrollY") == 0
        assert faults(page) == []
    finally:
        page.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": False})


FIJI = """coordinates = "lonlat"
bounds = [178.0, -18.5, -178.0, -16.0]
start = [178.6, -17.9]
goal = [-178.6, -16.6]
k = 5
threats = [{ x = 179.7, y = -17.2, spread = 20000, peak = 0.8 }]
[no_fly]
polygons = [[[179.7, -17.9], [-179.6, -17.9], [-179.6, -17.4], [179.7, -17.4]]]
"""
PLACE = """
    const box = document.querySelector('#map').getBoundingClientRect();
    return [box.x, box.y, box.width, box.height];
"""


def test_four_corners_stay_four_and_a_page_shows_what_was_saved(chromium: WebDriver, tmp_path: Path) -> None:
    file = tmp_path / "fiji.toml"
    file.write_text(FIJI, encoding="utf-8")
    with served(str(file)) as server:
        page = opened(chromium, server.url)
        assert page.title == "fiji – cgla live"
        corners = page.find_elements(By.CSS_SELECTOR, "[data-handle=corner]")
        assert len(corners) == 4
        drag(page, corners[2], 30, -20)
        until(page, SETTLED)
        assert page.title == "• fiji – cgla live"
        assert one(page, "#unsaved").is_displayed()
        assert asks_before_leaving(page)
        one(page, "#undo").click()
        assert page.title == "fiji – cgla live"
        assert not asks_before_leaving(page)
        one(page, "#redo").click()
        # numbers that are typed are those of the file
        corners[1].click()
        until(page, lambda: one(page, "#thing-title").text == "Corner 2 of no-fly area 1")
        for field, value in (("#at-x", "-179.55"), ("#at-y", "-17.95")):
            one(page, field).send_keys(Keys.CONTROL, "a", Keys.NULL, value, Keys.TAB)
        until(page, SETTLED)
        one(page, "#save button[type=submit]").click()
        until(page, lambda: "Saved as" in one(page, "#saved").text)
        assert (page.title, one(page, "#unsaved").is_displayed()) == ("fiji – cgla live", False)
        (ring,) = open_table(file).no_fly.polygons
        assert (len(ring), ring[0], ring[1], ring[3]) == (4, [179.7, -17.9], [-179.55, -17.95], [179.7, -17.4])
        # a page that is loaded again has it
        one(page, "#k-number").send_keys(Keys.CONTROL, "a", Keys.NULL, "9", Keys.TAB)
        until(page, ANSWERED)
        assert asks_before_leaving(page)
        leave(page)
        page = opened(chromium, server.url)
        assert (draft(page)["k"], len(draft(page)["areas"][0])) == (5, 4)
        assert len(page.find_elements(By.CSS_SELECTOR, "[data-handle=corner]")) == 4
        # a file that was changed meanwhile stays
        text = file.read_text(encoding="utf-8")
        file.write_text(f"{text}# mine\n", encoding="utf-8")
        one(page, "#add-threat").click()
        one(page, "#save button[type=submit]").click()
        until(page, lambda: one(page, "#replace").is_displayed())
        assert "fiji.toml has changed since it was read here" in one(page, "#saved").text
        assert file.read_text(encoding="utf-8") == f"{text}# mine\n"
        assert page.title.startswith("• ")
        one(page, "#replace").click()
        until(page, lambda: "Saved as" in one(page, "#saved").text)
        assert len(open_table(file).threats) == 2
        assert [line for line in faults(page) if "409" not in line] == []


def asks_before_leaving(page: WebDriver) -> bool:
    return bool(page.execute_script("return !window.dispatchEvent(new Event('beforeunload', {cancelable: true}))"))


def leave(page: WebDriver) -> None:
    """Undo all that is not saved, so that the browser does not ask."""
    page.execute_script("while (!document.querySelector('#undo').disabled) document.querySelector('#undo').click();")


def test_coordinates_axes_scale_and_north_are_those_of_the_earth(chromium: WebDriver, tmp_path: Path) -> None:
    """Pixels of the page, read by the projection of the map and measured on WGS84."""
    file = tmp_path / "north.toml"
    file.write_text('coordinates = "lonlat"\nbounds = [10, 68, 30, 78]\nstart = [12, 70]\ngoal = [28, 76]\nk = 0\n')
    with served(str(file)) as server:
        page = opened(chromium, server.url)
        problem = server.live.scenario.problem
        assert problem.projection is not None
        x_min, y_min, x_max, y_max = problem.bounds
        left, top, width, height = page.execute_script(PLACE)

        def place(x: float, y: float) -> tuple[float, float]:
            metres = (x_min + (x - left) / width * (x_max - x_min), y_max - (y - top) / height * (y_max - y_min))
            longitude, latitude = problem.projection.inverse(metres).tolist()
            return longitude, latitude

        for x, y in ((0.1, 0.2), (0.5, 0.5), (0.93, 0.9)):
            at = round(left + x * width), round(top + y * height)
            page.execute_script(
                "document.querySelector('#map').dispatchEvent(new PointerEvent('pointermove',"
                "{clientX: arguments[0], clientY: arguments[1], pointerType: 'mouse'}))",
                *at,
            )
            found = re.fullmatch(r"([\d.]+)° E, ([\d.]+)° N", one(page, "#at").text)
            assert found is not None
            assert (float(found[1]), float(found[2])) == pytest.approx(place(*at), abs=1e-3)
        ticks = page.execute_script(
            "return [...document.querySelectorAll('.tick')].map((line, i) => {"
            "const box = line.getBoundingClientRect();"
            "return [box.x, box.y, document.querySelectorAll('.tick-label')[i].textContent]; })"
        )
        assert len(ticks) >= 6
        for x, y, text in ticks:
            degrees = place(x, top + height) if text.endswith("E") else place(left, y)
            assert degrees[text.endswith("N")] == pytest.approx(float(text.split("°")[0]), abs=0.05)
        bar = page.execute_script("return document.querySelector('#scale .bar').getBBox().width")
        middle_x, middle_y = left + 0.5 * width, top + 0.5 * height
        ends = place(middle_x - 0.5 * bar, middle_y), place(middle_x + 0.5 * bar, middle_y)
        length = Geod(ellps="WGS84").inv(*ends[0], *ends[1])[2]
        said = re.match(r"(\d+) km", one(page, "#scale").text)
        assert said is not None
        assert length == pytest.approx(1000.0 * float(said[1]), rel=2e-3)
        assert "up in the middle of the map; elsewhere it differs by up to" in str(
            one(page, "#north").get_attribute("title")
        )
        # a typed place is the one that is planned, to a centimetre
        page.find_elements(By.CSS_SELECTOR, "[data-handle=goal]")[0].click()
        until(page, lambda: one(page, "#thing-title").text == "Goal")
        for field, value in (("#at-x", "27.1234567"), ("#at-y", "75.7654321")):
            one(page, field).send_keys(Keys.CONTROL, "a", Keys.NULL, value, Keys.TAB)
        until(page, SETTLED)
        goal = problem.projection.inverse(draft(page)["goal"])
        assert goal.tolist() == pytest.approx([27.1234567, 75.7654321], abs=1e-9)
        assert faults(page) == []


def test_a_corner_that_is_added_in_degrees_changes_no_area(chromium: WebDriver, tmp_path: Path) -> None:
    file = tmp_path / "wide.toml"
    ends = 'coordinates = "lonlat"\nbounds = [10, 68, 30, 78]\nstart = [12, 70]\ngoal = [28, 76]\nk = 0\n'
    file.write_text(f"{ends}[no_fly]\npolygons = [[[13, 71], [27, 71], [27, 73], [13, 73]]]\n", encoding="utf-8")
    with served(str(file)) as server:
        page = opened(chromium, server.url)
        places, before = server.live.places, draft(page)["areas"][0]
        page.execute_script("document.querySelector('[data-handle=area]').focus()")
        until(page, lambda: one(page, "#thing-title").text == "No-fly area 1")
        one(page, "#add-corner").click()
        until(page, SETTLED)
        after = draft(page)["areas"][0]
        assert (len(before), len(after)) == (4, 5)
        shapes = [places.closed(area, "an area").shape for area in (before, after)]
        assert shapes[0].symmetric_difference(shapes[1]).area < 1e-4 * shapes[0].area
        one(page, "#save button[type=submit]").click()
        until(page, lambda: "Saved as" in one(page, "#saved").text)
        assert [len(ring) for ring in open_table(file).no_fly.polygons] == [5]
        assert faults(page) == []


def test_a_plane_has_axes_and_no_north(page: WebDriver) -> None:
    labels = [label.text for label in page.find_elements(By.CSS_SELECTOR, ".tick-label")]
    assert labels[:6] == ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]
    assert {"x", "y ↑"} < set(labels)
    assert not one(page, "#north").is_displayed()
    assert one(page, "#scale").text == "0.2 map units"
    page.find_elements(By.CSS_SELECTOR, "[data-handle=start]")[0].click()
    until(page, lambda: one(page, "#thing-title").text == "Start")
    page.execute_script("document.querySelector('#map').dispatchEvent(new PointerEvent('pointerleave'))")
    assert one(page, "#at").text == "start: x 0.1000, y 0.1000"


UNDO_KEYS = """
    const [selector, init] = arguments;
    const node = selector ? document.querySelector(selector) : document.body;
    return node.dispatchEvent(new KeyboardEvent('keydown', {...init, bubbles: true, cancelable: true}));
"""


def test_a_field_undoes_its_own_text(page: WebDriver) -> None:
    page.find_elements(By.CSS_SELECTOR, "[data-handle=threat]")[0].click()
    one(page, "#add-threat").click()
    until(page, ANSWERED)
    assert len(draft(page)["threats"]) == 11
    page.find_elements(By.CSS_SELECTOR, "[data-handle=start]")[0].click()
    until(page, lambda: one(page, "#thing-title").text == "Start")
    for selector in ("#file", "#k-number", "#at-x"):
        field = one(page, selector)
        before = field.get_property("value")
        field.send_keys(Keys.END, "7")
        assert field.get_property("value") == f"{before}7"
        field.send_keys(Keys.CONTROL, "z")
        assert field.get_property("value") == before, selector
        field.send_keys(Keys.CONTROL, "y")
        field.send_keys(Keys.CONTROL, "z", Keys.CONTROL, "z")
        assert len(draft(page)["threats"]) == 11, selector
        for held in ("ctrlKey", "metaKey"):
            for key in ("z", "Z", "y"):
                assert page.execute_script(UNDO_KEYS, selector, {"key": key, held: True, "shiftKey": key == "Z"})
    # what was entered, and is undone in its field, no longer holds
    field = one(page, "#k-number")
    field.send_keys(Keys.CONTROL, "a", Keys.NULL, "4", Keys.ENTER)
    assert draft(page)["k"] == 4
    field.send_keys(Keys.CONTROL, "z")
    assert (draft(page)["k"], field.get_property("value")) == (10, "10")
    field.send_keys(Keys.TAB)
    assert (draft(page)["k"], len(draft(page)["threats"])) == (10, 11)
    for _ in range(2):
        one(page, "#undo").click()
    # elsewhere it is the map that is undone, sliders included
    for selector, held in ((None, "ctrlKey"), (None, "metaKey"), ("#k", "ctrlKey"), ("#undo", "metaKey")):
        assert not page.execute_script(UNDO_KEYS, selector, {"key": "z", held: True})
        assert len(draft(page)["threats"]) == 10, selector
        again = {"key": "y"} if held == "ctrlKey" else {"key": "Z", "shiftKey": True}
        assert not page.execute_script(UNDO_KEYS, selector, {**again, held: True})
        assert len(draft(page)["threats"]) == 11
    # the key of another alphabet, and a letter that is written with Ctrl and Alt
    assert not page.execute_script(UNDO_KEYS, None, {"key": "я", "code": "KeyZ", "ctrlKey": True})
    assert len(draft(page)["threats"]) == 10
    assert page.execute_script(UNDO_KEYS, None, {"key": "z", "ctrlKey": True, "altKey": True})
    assert faults(page) == []


def test_an_area_that_crosses_itself_is_drawn_as_it_is_closed(page: WebDriver) -> None:
    page.execute_script(
        "live.state.draft.areas.push([0, 2, 4, 1, 3].map(i => [0.5 + 0.3 * Math.sin(1.2566370614 * i),"
        "0.5 + 0.3 * Math.cos(1.2566370614 * i)]));"
    )
    one(page, "#k-number").send_keys(Keys.CONTROL, "a", Keys.NULL, "4", Keys.TAB)
    until(page, SETTLED)
    assert "no-fly area 1 crosses itself: all that it encloses is closed" in one(page, "#note").text
    middle = page.execute_script(
        "const node = document.querySelector('[data-handle=area]');"
        "const {width, height} = document.querySelector('#map').viewBox.baseVal;"
        "return [node.isPointInFill(new DOMPoint(width / 2, height / 2)), node.getAttribute('d').split('L').length]"
    )
    assert middle == [True, 10]
    assert faults(page) == []


#: Random drags: position of the handle in the list, target (also beyond the border), and an action after it.
parts = st.floats(-0.03, 1.03)
deeds = st.one_of(
    st.none(), st.sampled_from(["add-threat", "add-area", "undo", "redo"]), st.integers(0, 700).map(lambda k: f"k={k}")
)
drags = st.tuples(st.floats(0.0, 1.0, exclude_max=True), st.tuples(parts, parts), deeds)


#: A browser takes seconds for an example, and ten drags are read as they are: what fails is not made smaller.
in_a_browser = settings(
    examples(5),
    phases=[Phase.reuse, Phase.generate],
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)


@in_a_browser
@given(made=st.lists(drags, min_size=10, max_size=10))
def test_random_drags_leave_no_error_behind(
    chromium: WebDriver, server: LiveServer, capfd: pytest.CaptureFixture[str], made: list[Drag]
) -> None:
    """Drag any handles anywhere while settings change; then the page still shows the true numbers."""
    page = opened(chromium, server.url)
    box = one(page, "#map").rect
    for which, (across, down), deed in made:
        places = page.execute_script(
            "return [...document.querySelectorAll('[data-handle]')].map(node => node.getBoundingClientRect().toJSON())"
        )
        at = places[int(which * len(places))]
        begin = at["x"] + at["width"] / 2, at["y"] + at["height"] / 2
        end = box["x"] + across * box["width"], box["y"] + down * box["height"]
        builder = ActionBuilder(page, duration=5)
        builder.pointer_action.move_to_location(*map(round, begin)).pointer_down()
        for part in (0.3, 0.6, 1.0):
            builder.pointer_action.move_to_location(
                *(round(a + part * (b - a)) for a, b in zip(begin, end, strict=True))
            )
        builder.pointer_action.pointer_up()
        builder.perform()
        if deed is not None and deed.startswith("k="):
            page.execute_script(
                "const k = document.querySelector('#k'); k.value = arguments[0]; k.dispatchEvent(new Event('input'));",
                int(deed.removeprefix("k=")),
            )
        elif deed is not None:
            page.execute_script("document.getElementById(arguments[0]).click()", deed)
    until(page, SETTLED)
    assert faults(page) == []
    assert capfd.readouterr().err == ""
    answer = page.execute_script("return live.state.answer")
    assert answer["error"] or answer["bound"] <= answer["cost"] * (1 + 1e-9)
    requests = [entry for entry in page.get_log("performance") if '"Network.requestWillBeSent"' in entry["message"]]
    assert requests
    assert all("127.0.0.1" in entry["message"] or '"url":"data:' in entry["message"] for entry in requests)
