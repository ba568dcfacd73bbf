"""The report in a real browser: Chromium without a window, driven by selenium."""

import dataclasses
import json
from collections.abc import Callable, Iterator, Sequence
from http import HTTPStatus
from pathlib import Path
from typing import Any

import pytest
import shapely
from chromium import NEEDS_BROWSER, browser, one
from report_studies import ODD, failing, odd_runs, small_runs, stored_of
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.remote.webdriver import WebDriver
from selenium.webdriver.support.ui import WebDriverWait
from serving import serving

from cgla_graph.comparisons.report.loopback import HTML, Response
from cgla_graph.comparisons.report.page import report_html, write_report
from cgla_graph.comparisons.report.view import State, ViewServer
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.runner import Run, compare
from cgla_graph.comparisons.study.store import Stored
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Status
from cgla_graph.scenarios.scenario import Scenario

pytestmark = [pytest.mark.slow, NEEDS_BROWSER]

#: Where the focus is; a complaint where it cannot be seen.
FOCUSED = """
    const node = document.activeElement, ring = getComputedStyle(node);
    const seen = ring.outlineStyle !== 'none' && ring.outlineWidth !== '0px';
    if (node !== document.body && !seen) return 'no ring: ' + node.outerHTML.slice(0, 80);
    if (node.dataset.key) return node.closest('fieldset') ? node.closest('fieldset').id : node.dataset.key;
    return node.id || (node.closest('th') && 'head') || (node.dataset.command && 'rerun') || node.tagName;
"""
#: Controls and pictures without a name for those who cannot see them.
NAMELESS = """
    const named = node => node.closest('.modebar') || (node.tagName === 'BUTTON' && node.textContent.trim()) ||
        node.getAttribute('aria-label') || node.getAttribute('aria-labelledby') || (node.labels && node.labels.length);
    return [...document.querySelectorAll('button, select, input, [role=region], [role=group], svg[role=img]')]
        .filter(node => !named(node)).map(node => node.outerHTML.slice(0, 120));
"""
#: Contrast of a text against the page (WCAG 2, relative luminance).
CONTRAST = """
    const canvas = document.createElement('canvas').getContext('2d', {willReadFrequently: true});
    const bytes = colour => {
        canvas.fillStyle = colour;
        canvas.fillRect(0, 0, 1, 1);
        return [...canvas.getImageData(0, 0, 1, 1).data].slice(0, 3);
    };
    const linear = v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
    const light = colour => bytes(colour).map(v => linear(v / 255))
        .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
    const text = getComputedStyle(document.querySelector(arguments[0])).color;
    const pair = [text, getComputedStyle(document.body).backgroundColor].map(light);
    return (Math.max(...pair) + 0.05) / (Math.min(...pair) + 0.05);
"""
#: Whether the map has its risk first, then the no-fly area, then the paths: what comes later covers what came before.
ORDER = """
    const [risk, wall, path] = ['#map .imagelayer image', '#map .shapelayer path[fill-rule=evenodd]', arguments[0]]
        .map(selector => document.querySelector(selector));
    const before = (a, b) => Boolean(a.compareDocumentPosition(b) & Node.DOCUMENT_POSITION_FOLLOWING);
    return wall.getBoundingClientRect().width > 50 && before(risk, wall) && before(wall, path);
"""
PICTURES = ("map", "curves", "success", "profile")
PATHS = "#map .scatterlayer .trace path.js-line"


@pytest.fixture(scope="module")
def chromium() -> Iterator[WebDriver]:
    with browser() as driver:
        yield driver


@pytest.fixture(scope="module")
def stored() -> Stored:
    """Return a small study with enough failures and runs for three pages."""
    runs = small_runs()
    many = [dataclasses.replace(run, seed=seed) for run in runs if run.seed == 1 for seed in range(3, 20)]
    return stored_of([*runs, *many, failing(runs[0], Status.TIMED_OUT, "stopped after 5 s")])


@pytest.fixture(scope="module")
def address(stored: Stored, tmp_path_factory: pytest.TempPathFactory) -> str:
    return write_report(stored, tmp_path_factory.mktemp("report") / "report.html").as_uri()


@pytest.fixture
def page(chromium: WebDriver, address: str) -> WebDriver:
    """Return the page anew, as wide as a desk, in light colours."""
    return opened(chromium, address)


def opened(driver: WebDriver, address: str, *, width: int = 1280, colours: str = "light") -> WebDriver:
    metrics = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    run = driver.execute_cdp_cmd
    run("Emulation.setDeviceMetricsOverride", metrics)
    # a page that is still gliding to its place takes no clicks
    wishes = {"prefers-color-scheme": colours, "prefers-reduced-motion": "reduce"}
    run("Emulation.setEmulatedMedia", {"features": [{"name": name, "value": value} for name, value in wishes.items()]})
    for log in ("browser", "performance"):
        driver.get_log(log)
    driver.get(address)
    driver.execute_script("localStorage.clear()")
    return driver


def logged(driver: WebDriver, log: str) -> list[dict[str, Any]]:
    return list(driver.get_log(log))


def texts(driver: WebDriver, selector: str) -> list[str]:
    script = "return [...document.querySelectorAll(arguments[0])].map(node => node.textContent)"
    return [str(text) for text in driver.execute_script(script, selector)]


def until(driver: WebDriver, check: Callable[[], object]) -> None:
    WebDriverWait(driver, 20, poll_frequency=0.05).until(lambda _: check())


def show(driver: WebDriver, selector: str) -> None:
    driver.execute_script(
        "document.querySelector(arguments[0]).scrollIntoView({behavior: 'instant', block: 'center'})", selector
    )


def n_paths(driver: WebDriver) -> int:
    """Count the lines that are drawn on the map."""
    return len(driver.find_elements(By.CSS_SELECTOR, PATHS))


def with_map(driver: WebDriver) -> None:
    show(driver, "#map")
    until(driver, lambda: n_paths(driver) > 0)


def draw_all(driver: WebDriver) -> None:
    """Go past every picture, so that all are drawn."""
    for name in PICTURES:
        if driver.execute_script("return document.querySelector(arguments[0]).hidden", f"#{name}"):
            # of one scenario, there is no profile
            continue
        show(driver, f"#{name}")
        until(driver, lambda name=name: driver.find_elements(By.CSS_SELECTOR, f"#{name} .scatterlayer .trace"))


def choose(driver: WebDriver, selector: str, value: str) -> None:
    script = (
        "const s = document.querySelector(arguments[0]); s.value = arguments[1]; s.dispatchEvent(new Event('change'))"
    )
    driver.execute_script(script, selector, value)


def column(driver: WebDriver, key: str) -> list[str]:
    place = texts(driver, "#table thead th button").index(key) + 1
    return texts(driver, f"#table tbody tr > :nth-child({place})")


def sort(driver: WebDriver, key: str) -> str | None:
    """Press the head of a column; return what it says of its order."""
    show(driver, "#table thead")
    place = texts(driver, "#table thead th button").index(key)
    driver.find_elements(By.CSS_SELECTOR, "#table thead th button")[place].click()
    return driver.find_elements(By.CSS_SELECTOR, "#table thead th")[place].get_attribute("aria-sort")


def numbers(words: Sequence[str]) -> list[float]:
    return [float(word) for word in words if word != "–"]


# ---- drawing


def test_every_picture_is_drawn_without_errors_or_requests(page: WebDriver) -> None:
    draw_all(page)
    for name in PICTURES:
        label = one(page, f"#{name} .picture").get_attribute("aria-label")
        assert label is not None
        assert "solvers" in label
    assert logged(page, "browser") == []
    asked = [
        message["params"]["request"]["url"]
        for entry in logged(page, "performance")
        if (message := json.loads(entry["message"])["message"])["method"] == "Network.requestWillBeSent"
    ]
    assert [url[:60] for url in asked if not url.startswith(("data:", "blob:", "file:"))] == []
    assert sum(url.startswith("file:") for url in asked) == 1


def test_pictures_wait_until_they_are_seen(page: WebDriver) -> None:
    assert page.execute_script("return window.Plotly === undefined")
    with_map(page)
    assert page.execute_script("return window.Plotly !== undefined")
    assert not page.find_elements(By.CSS_SELECTOR, "#profile .scatterlayer")


def test_toggling_a_solver_hides_its_path_and_its_curves(page: WebDriver) -> None:
    with_map(page)
    before = n_paths(page)
    box = one(page, "#legend input[value='cgla']")
    assert box.is_selected()
    box.click()
    until(page, lambda: n_paths(page) == before - 1)
    assert not one(page, "#legend-overall input[value='cgla']").is_selected()
    show(page, "#profile")
    until(page, lambda: page.find_elements(By.CSS_SELECTOR, "#profile .scatterlayer .trace"))
    assert len(page.find_elements(By.CSS_SELECTOR, "#profile .scatterlayer .trace")) == 3
    show(page, "#map")
    one(page, "#legend input[value='cgla']").click()
    until(page, lambda: n_paths(page) == before)
    one(page, "#legend [data-show='none']").click()
    until(page, lambda: n_paths(page) == 0)


def test_no_fly_areas_lie_over_the_risk_and_under_the_paths(page: WebDriver) -> None:
    choose(page, "#scenario", "1")
    with_map(page)
    order = page.execute_script(ORDER, PATHS)
    assert order


def test_the_clearance_is_drawn_around_areas_and_ends_are_named_above_paths(
    chromium: WebDriver, tmp_path: Path
) -> None:
    problem = Problem((0.1, 0.5), (0.9, 0.5), no_fly=shapely.box(0.4, 0.3, 0.6, 0.6), clearance=0.1)
    where = Scenario("margin", "", problem, Lattice(5, bounds=problem.bounds))
    runs = list(compare([where], [Entrant.parse("hybrid")]))
    driver = opened(chromium, write_report(stored_of(runs), tmp_path / "margin.html").as_uri())
    with_map(driver)
    dashed = [
        path
        for path in driver.find_elements(By.CSS_SELECTOR, "#map .shapelayer path")
        if "dash" in (path.get_attribute("style") or "")
    ]
    assert len(dashed) == 1
    assert one(driver, "#margin-note").is_displayed()
    assert texts(driver, "#map .annotation-text") == ["start", "goal"]
    layers = driver.execute_script(
        "const [path, words] = ['.scatterlayer', '.infolayer'].map(name => document.querySelector('#map ' + name));"
        "return path.compareDocumentPosition(words) & Node.DOCUMENT_POSITION_FOLLOWING"
    )
    assert layers
    # of one scenario, success takes the whole width
    width = driver.execute_script(
        "return [success, document.querySelector('main')].map(one => one.getBoundingClientRect().width)"
    )
    assert width[0] > 0.85 * width[1]


@pytest.mark.parametrize("width", [390, 1280])
def test_a_row_is_copied_without_scrolling_and_wide_tables_say_that_they_scroll(
    chromium: WebDriver, address: str, width: int
) -> None:
    driver = opened(chromium, address, width=width)
    show(driver, "#table")
    button = one(driver, "#table tbody button")
    box = driver.execute_script(
        "const {left, right} = arguments[0].getBoundingClientRect(); return [left, right, innerWidth]", button
    )
    assert 0 <= box[0] < box[1] <= box[2]
    hint = "return getComputedStyle(arguments[0].closest('.scroll'), '::before').content"
    assert "→" in driver.execute_script(hint, button)
    driver.execute_script("arguments[0].closest('.scroll').scrollLeft = 1e5", button)
    until(driver, lambda: "←" in driver.execute_script(hint, button))


def test_y_grows_downwards_where_the_map_says_so(page: WebDriver) -> None:
    def goes_down() -> bool:
        with_map(page)
        low, high = page.execute_script("return document.querySelector('[data-picture=map]').layout.yaxis.range")
        return bool(low > high)

    assert not goes_down()
    choose(page, "#scenario", "1")
    until(page, goes_down)


def test_pointing_at_a_path_tells_its_numbers(page: WebDriver, stored: Stored) -> None:
    with_map(page)
    one(page, "#legend [data-show='none']").click()
    one(page, "#legend input[value='straight-line']").click()
    until(page, lambda: n_paths(page) == 1)
    path = one(page, PATHS)
    ActionChains(page).move_to_element(path).perform()
    until(page, lambda: texts(page, "#map .hoverlayer .hovertext"))
    (words,) = texts(page, "#map .hoverlayer .hovertext")
    straight = next(run for run in stored.runs if run.solver == "straight-line").solution
    assert "straight-line" in words
    assert f"{straight.cost:.4f}"[:5] in words


def test_the_numbers_of_a_picture_are_there_as_a_table(page: WebDriver, stored: Stored) -> None:
    for name in PICTURES:
        show(page, f"#{name} details")
        one(page, f"#{name} summary").click()
        until(page, lambda name=name: page.find_elements(By.CSS_SELECTOR, f"#{name} details tbody tr"))
        assert sorted(texts(page, f"#{name} details tbody th")) == sorted(stored.solvers)
    assert not [words for words in texts(page, "details td") if "NaN" in words or "undefined" in words]


# ---- the table


def test_sorting(page: WebDriver) -> None:
    assert sort(page, "cost") == "ascending"
    costs = numbers(column(page, "cost"))
    assert costs == sorted(costs)
    assert sort(page, "cost") == "descending"
    costs = numbers(column(page, "cost"))
    assert costs == sorted(costs, reverse=True)
    # runs without a cost come last in both orders
    assert len(costs) == 25
    assert sort(page, "scenario") == "ascending"
    assert column(page, "scenario") == sorted(column(page, "scenario"))
    assert len(page.find_elements(By.CSS_SELECTOR, "#table th[aria-sort]")) == 1


def test_every_cell_of_a_run_is_written(page: WebDriver, stored: Stored) -> None:
    choose(page, "#filter-solver", "cgla")
    heads = ["#", "scenario", "solver", "seed", "status", "cost", "gap", "length", "risk", "clearance"]
    heads += ["time", "build", "evaluations", "memory", "message"]
    assert texts(page, "#table thead th button") == heads
    run = next(run for run in stored.runs if run.solver == "cgla")
    first = dict(zip([*heads, "run it again"], texts(page, "#table tbody tr:first-child td"), strict=True))
    assert (first["#"], first["solver"], first["status"]) == (str(run.number), "cgla", "optimal")
    assert first["cost"] == f"{run.solution.cost:#.6g}"
    assert first["gap"] == f"{100.0 * run.solution.gap:+.2f} %"
    assert first["risk"] == f"{run.solution.risk:#.4g}"
    assert first["evaluations"] == f"{run.solution.evaluations:,}"
    assert first["time"].endswith(("s", "ms", "µs"))
    assert first["memory"] == "–"


def test_filtering(page: WebDriver, stored: Stored) -> None:
    choose(page, "#filter-solver", "straight-line")
    assert set(column(page, "solver")) == {"straight-line"}
    choose(page, "#filter-status", "!")
    assert set(column(page, "status")) == {"infeasible"}
    one(page, "#filters [type=reset]").click()
    one(page, "#filter-text").send_keys("TIMED 5 paper")
    until(page, lambda: len(column(page, "solver")) == 1)
    assert column(page, "message") == ["stopped after 5 s"]
    assert texts(page, "#count") == [f"1–1 of 1 ({len(stored.runs)} in all)"]
    one(page, "#filter-text").send_keys(" nowhere")
    until(page, lambda: texts(page, "#count") == [f"None of {len(stored.runs)} runs"])


def test_paging(page: WebDriver, stored: Stored) -> None:
    def press(name: str) -> list[str]:
        page.execute_script("document.querySelector(arguments[0]).click()", f"[data-page={name}]")
        return column(page, "#")

    n = len(stored.runs)
    seen = column(page, "#")
    while one(page, "[data-page=next]").is_enabled():
        seen += press("next")
    assert seen == [str(number) for number in range(1, n + 1)]
    assert press("first") == seen[:25]
    assert press("last") == seen[25 * ((n - 1) // 25) :]
    choose(page, "#size", "50")
    assert press("first") == seen[:50]


def test_failures_lead_to_their_runs(page: WebDriver) -> None:
    page.execute_script("document.querySelector('.show-runs[data-status=timed-out]').click()")
    assert column(page, "message") == ["stopped after 5 s"]
    assert one(page, "#filter-status").get_attribute("value") == "timed-out"


def test_a_row_says_how_to_run_it_again(page: WebDriver) -> None:
    page.execute_script("""
        window.copied = null;
        Object.defineProperty(navigator, 'clipboard', {value: {writeText: async text => { window.copied = text; }}});
        document.querySelector('#table tbody tr:nth-child(3) button').click();""")
    until(page, lambda: page.execute_script("return window.copied"))
    assert page.execute_script("return window.copied") == "cgla results 'results/my study' --rerun 3"
    until(page, lambda: "copied" in texts(page, "#table tbody tr:nth-child(3) button"))


# ---- for everyone


def test_everything_can_be_reached_and_worked_with_the_keyboard(page: WebDriver) -> None:
    with_map(page)
    show(page, "body")
    page.execute_script("document.activeElement.blur()")
    reached = set()
    for _ in range(150):
        ActionChains(page).send_keys(Keys.TAB).perform()
        reached.add(page.execute_script(FOCUSED))
    assert not [where for where in reached if where.startswith("no ring")]
    wanted = {"theme", "scenario", "next", "legend", "legend-overall", "filter-text", "filter-solver", "head", "rerun"}
    assert wanted <= reached
    before = n_paths(page)
    page.execute_script("document.querySelector('#legend input').focus()")
    ActionChains(page).send_keys(Keys.SPACE).perform()
    until(page, lambda: n_paths(page) == before - 1)
    # the list is made anew with another scenario, and the focus stays where it was
    page.execute_script("document.querySelector('#table thead button').focus()")
    ActionChains(page).send_keys(Keys.ENTER).perform()
    assert one(page, "#table thead th").get_attribute("aria-sort") == "ascending"


def test_every_control_has_a_name(page: WebDriver) -> None:
    with_map(page)
    nameless = page.execute_script(NAMELESS)
    assert nameless == []
    assert len(page.find_elements(By.CSS_SELECTOR, "figure")) == len(page.find_elements(By.CSS_SELECTOR, "figcaption"))


def contrast(driver: WebDriver, selector: str) -> float:
    return float(driver.execute_script(CONTRAST, selector))


@pytest.mark.parametrize("colours", ["light", "dark"])
def test_light_and_dark(chromium: WebDriver, address: str, colours: str) -> None:
    page = opened(chromium, address, colours=colours)
    with_map(page)

    def shade() -> int:
        colour = str(page.execute_script("return getComputedStyle(document.body).backgroundColor"))
        return sum(map(int, colour.strip("rgb()").split(",")))

    assert (shade() < 200) is (colours == "dark")
    for selector in ("h1", ".facts", "figcaption", ".note", "nav a", ".status.bad", "summary"):
        assert contrast(page, selector) >= 4.5, selector
    stroke = "return getComputedStyle(document.querySelector(arguments[0])).stroke"
    before = page.execute_script(stroke, PATHS)
    one(page, "#theme").click()
    assert (shade() < 200) is (colours == "light")
    # pictures out of sight are drawn again when they come into view
    show(page, "#map")
    until(page, lambda: page.execute_script(stroke, PATHS) != before)
    page.refresh()
    assert (shade() < 200) is (colours == "light"), "the choice is remembered"
    one(page, "#theme").click()
    assert (one(page, "#theme").text.lower(), (shade() < 200) is (colours == "dark")) == (colours, True)
    one(page, "#theme").click()
    assert one(page, "#theme").text == "Auto"


@pytest.mark.parametrize("width", [360, 768, 1280])
def test_no_width_makes_the_page_scroll_sideways(chromium: WebDriver, address: str, width: int) -> None:
    page = opened(chromium, address, width=width)
    draw_all(page)
    show(page, "#runs")
    for details in page.find_elements(By.CSS_SELECTOR, "details"):
        page.execute_script("arguments[0].open = true", details)
    assert page.execute_script("return document.documentElement.scrollWidth") <= width
    assert page.execute_script("return document.querySelector('#map .picture').getBoundingClientRect().right") <= width


def test_paper_shows_all_pictures_in_dark_ink(chromium: WebDriver, address: str) -> None:
    page = opened(chromium, address, colours="dark")
    page.execute_script("dispatchEvent(new Event('beforeprint'))")
    for name in PICTURES:
        assert page.find_elements(By.CSS_SELECTOR, f"#{name} .scatterlayer .trace")
        drawn = page.execute_script(
            f"return document.querySelector('#{name} svg.main-svg').getBoundingClientRect().width"
        )
        assert drawn <= 700
    assert page.execute_script("return getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    assert not one(page, "nav").is_displayed()
    assert not one(page, "#theme").is_displayed()
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "screen"})
    page.execute_script("dispatchEvent(new Event('afterprint'))")
    assert one(page, "#theme").text == "Auto"


# ---- what names may not do


def test_odd_names_appear_as_text_and_run_nothing(chromium: WebDriver, tmp_path: Path) -> None:
    stored = stored_of(odd_runs(), title=f"title {ODD}")
    page = opened(chromium, write_report(stored, tmp_path / "odd.html").as_uri())
    draw_all(page)
    assert not one(page, "#profile").is_displayed()
    assert "gap" in texts(page, "#curves .ytitle")[0]
    show(page, "#map summary")
    one(page, "#map summary").click()
    show(page, "#map")
    # of two equal paths the one with the odd name
    show(page, "#legend input[value='straight-line']")
    one(page, "#legend input[value='straight-line']").click()
    show(page, "#map .picture")
    until(page, lambda: n_paths(page) == 1)
    ActionChains(page).move_to_element(one(page, PATHS)).perform()
    until(page, lambda: texts(page, "#map .hoverlayer .hovertext"))
    assert "<script>window.hacked=1</script>" in texts(page, "#map .hoverlayer .hovertext")[0]
    assert page.title.split() == f"title {ODD}".split()
    assert f"solver {ODD}" in column(page, "solver")
    assert f"message {ODD}" in column(page, "message")
    assert f"scenario {ODD}" in texts(page, "#scenario option")[0]
    assert any(f"solver {ODD}" in words for words in texts(page, "#legend label"))
    assert page.execute_script("return window.hacked") is None
    assert page.execute_script("return document.querySelectorAll('img').length") == 0
    assert logged(page, "browser") == []


# ---- while a study runs


class Growing:
    """A study that goes on, as `cgla view` shows it."""

    def __init__(self, stored: Stored) -> None:
        self.stored = stored

    def state(self) -> State:
        now = self.stored
        return State(len(now.runs), now.n_cells, now.is_complete, str(len(now.runs)))

    def page(self) -> Response:
        return Response(HTTPStatus.OK, HTML, report_html(self.stored, live=True).encode())


def half_of(runs: Sequence[Run]) -> Stored:
    """Return the study while its last scenario is still to come."""
    return stored_of(list(runs)[:-20], n_cells=len(runs))


def test_a_live_page_follows_and_keeps_what_was_chosen(chromium: WebDriver, stored: Stored) -> None:
    whole, growing = stored_of(stored.runs), Growing(half_of(stored.runs))
    with serving(ViewServer(growing)) as server:  # type: ignore[arg-type]
        page = opened(chromium, server.url)
        with_map(page)
        one(page, "#legend input[value='cgla']").click()
        choose(page, "#scenario", "1")
        show(page, "#runs")
        sort(page, "cost")
        sort(page, "cost")
        choose(page, "#filter-solver", "hybrid")
        one(page, "#filter-text").send_keys("found")
        page.execute_script("document.querySelector('[data-key=sessions]').open = true")
        assert page.find_elements(By.CSS_SELECTOR, "progress")
        before = texts(page, "#count")
        page.execute_script("window.same = true")
        growing.stored = whole
        until(page, lambda: not page.find_elements(By.CSS_SELECTOR, "progress"))
        until(page, lambda: texts(page, "#live") == ["complete"])
        assert page.execute_script("return window.same"), "the page was not loaded anew"
        assert texts(page, "#count") != before
        assert not one(page, "#legend input[value='cgla']").is_selected()
        assert one(page, "#scenario").get_attribute("value") == "1"
        assert set(column(page, "solver")) == {"hybrid"}
        costs = numbers(column(page, "cost"))
        assert costs == sorted(costs, reverse=True)
        assert one(page, "#filter-text").get_attribute("value") == "found"
        assert page.execute_script("return document.activeElement.id") == "filter-text"
        assert page.execute_script("return document.querySelector('[data-key=sessions]').open")
        show(page, "#map")
        until(page, lambda: n_paths(page) > 0)
        assert [entry for entry in logged(page, "browser") if entry["level"] == "SEVERE"] == []
    until(page, lambda: texts(page, "#live") == ["not connected"])
