"""The page of `cgla live` in Chromium without a window, driven by selenium; importing it skips where there is none."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

from chromium import NEEDS_BROWSER, browser, one
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.remote.webdriver import WebDriver
from selenium.webdriver.remote.webelement import WebElement
from selenium.webdriver.support.ui import WebDriverWait
from serving import serving

from cgla_graph.comparisons.live.desk import Desk
from cgla_graph.comparisons.live.draft import LiveMap
from cgla_graph.comparisons.live.planning import Planner
from cgla_graph.comparisons.live.server import LiveServer

__all__ = ["NEEDS_BROWSER", "browser", "one"]
#: Whether the last state is answered, in full.
SETTLED = """
    const {state} = live;
    return live.idle && state.answer && (state.answer.error || state.answer.full);
"""
#: Whether the last state is answered.
ANSWERED = "return live.idle"


def served(spec: str) -> AbstractContextManager[LiveServer]:
    live = LiveMap.open(spec)
    planner = Planner(live)
    planner.warm_up()
    return serving(LiveServer(live, desk=Desk(planner)))


def opened(driver: WebDriver, address: str, *, width: int = 1280, phone: bool = False) -> WebDriver:
    metrics = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": phone}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": phone})
    for log in ("browser", "performance"):
        driver.get_log(log)
    driver.get(address)
    until(driver, "return Boolean(window.live)")
    until(driver, SETTLED)
    return driver


def until(driver: WebDriver, script: str | Callable[[], object]) -> None:
    WebDriverWait(driver, 60, poll_frequency=0.05).until(
        lambda _: driver.execute_script(script) if isinstance(script, str) else script()
    )


def number(driver: WebDriver, selector: str) -> float:
    return float(one(driver, selector).text.removesuffix(" %").replace(",", ""))


def drag(driver: WebDriver, node: WebElement, dx: float, dy: float) -> None:
    """Drag by pixels, in steps as a hand does."""
    chain = ActionChains(driver, duration=10).click_and_hold(node)
    for _ in range(4):
        chain.move_by_offset(round(dx / 4), round(dy / 4))
    chain.release().perform()


def draft(driver: WebDriver) -> dict[str, Any]:
    found: dict[str, Any] = driver.execute_script("return live.state.draft")
    return found


def faults(driver: WebDriver) -> list[str]:
    return [entry["message"] for entry in driver.get_log("browser")]
