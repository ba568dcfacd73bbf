"""Chromium without a window, driven by selenium; importing it skips where there is none."""

import importlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

#: Whether these tests must not skip: on CI.
NEEDED = bool(os.environ.get("CGLA_NEEDS_BROWSER"))
if NEEDED:
    webdriver = importlib.import_module("selenium.webdriver")
else:
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
from selenium.webdriver.common.by import By  # noqa: E402
from selenium.webdriver.remote.webdriver import WebDriver  # noqa: E402
from selenium.webdriver.remote.webelement import WebElement  # noqa: E402

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")
#: Of every test that needs a browser.
NEEDS_BROWSER = pytest.mark.skipif(
    not NEEDED and (CHROMIUM is None or DRIVER is None),
    reason="no Chromium with its driver is installed (chromium, chromedriver)",
)
SWITCHES = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--disable-quic",
    "--window-size=1280,900",
)


@contextmanager
def browser() -> Iterator[WebDriver]:
    """Start a browser that logs what its pages say and ask for."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        options = webdriver.ChromeOptions()
        options.binary_location = str(CHROMIUM)
        for switch in (*SWITCHES, f"--user-data-dir={profile}"):
            options.add_argument(switch)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        # with the driver's path given, selenium looks for none and downloads none
        driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(str(DRIVER)))
        try:
            yield driver
        finally:
            driver.quit()


def one(driver: WebDriver, selector: str) -> WebElement:
    return driver.find_element(By.CSS_SELECTOR, selector)
