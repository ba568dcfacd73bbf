"""Speed of `cgla live`, measured in the browser: ``make bench``. Skipped by default, as tests take no times."""

import statistics

import pytest
from live_page import ANSWERED, NEEDS_BROWSER, SETTLED, browser, one, opened, served, until
from pytest_benchmark.fixture import BenchmarkFixture
from selenium.webdriver.common.action_chains import ActionChains

pytestmark = [pytest.mark.slow, NEEDS_BROWSER]

#: What of a drag is measured: from the pointer's move to the picture with the bound and the tube of that very state.
LATENCIES = "return live.latencies.splice(0)"


def test_a_drag_is_answered_on_the_papers_map(benchmark: BenchmarkFixture) -> None:
    """Each drag of a threat by a few pixels, and one long drag in which states replace one another."""
    with browser() as driver, served("paper") as server:
        page = opened(driver, server.url)
        threat = one(page, "[data-handle=threat]")

        def small_drag() -> None:
            by = 7 if len(single) % 2 else -7
            ActionChains(page, duration=0).click_and_hold(threat).move_by_offset(by, by).release().perform()
            until(page, ANSWERED)
            single.extend(page.execute_script(LATENCIES))

        single: list[float] = []
        page.execute_script(LATENCIES)
        benchmark.pedantic(small_drag, rounds=40, warmup_rounds=3)
        until(page, SETTLED)
        page.execute_script(LATENCIES)
        chain = ActionChains(page, duration=16).click_and_hold(threat)
        for step in range(120):
            chain.move_by_offset(2 if step % 60 < 30 else -2, 1 if step % 60 < 30 else -1)
        chain.release().perform()
        until(page, SETTLED)
        steady = page.execute_script(LATENCIES)
    found = {"single": statistics.median(single), "while dragging": statistics.median(steady)}
    benchmark.extra_info.update({f"{name}, median ms": round(value) for name, value in found.items()})
    print(
        "\nfrom a drag to the updated bound, median: " + ", ".join(f"{name} {ms:.0f} ms" for name, ms in found.items())
    )
