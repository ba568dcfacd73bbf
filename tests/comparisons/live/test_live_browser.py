"""The page of `cgla live` in a real browser: dragged by mouse, finger and keyboard, at random too."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from live_page import ANSWERED, NEEDS_BROWSER, SETTLED, browser, draft, drag, faults, number, one, opened, served, until
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.actions.action_builder import ActionBuilder
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.remote.webdriver import WebDriver
from strategies import examples

from cgla_graph.comparisons.live.server import LiveServer
from cgla_graph.scenarios.scenario import load_scenario

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
        one(page, "#save button[type=submit]").click()
        until(page, lambda: one(page, "#replace").is_displayed())
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
