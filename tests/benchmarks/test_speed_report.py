"""The report of 20 000 runs: written in under 30 s, under 15 MB, interactive within 3 s in Chromium."""

import sys
import time
from pathlib import Path

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

# the helpers of the browser's tests
sys.path.insert(0, str(Path(__file__).parents[1] / "comparisons" / "report"))
from chromium import CHROMIUM, DRIVER, browser
from report_studies import large_study
from test_report_browser import with_map

from cgla_graph.comparisons.report.page import write_report

N_RUNS = 20_000


@pytest.mark.skipif(CHROMIUM is None or DRIVER is None, reason="no Chromium with its driver is installed")
def test_a_large_report(benchmark: BenchmarkFixture, tmp_path: Path) -> None:
    stored = large_study()
    assert len(stored.runs) == N_RUNS
    began = time.perf_counter()
    path = benchmark.pedantic(write_report, args=(stored, tmp_path / "report.html"), rounds=1)
    written, size = time.perf_counter() - began, path.stat().st_size / 1e6
    with browser() as page:
        began = time.perf_counter()
        page.get(path.as_uri())
        page.execute_script("document.querySelector('#table th[data-key=cost] button').click()")
        assert page.execute_script("return document.querySelectorAll('#table tbody tr').length") == 25
        interactive = time.perf_counter() - began
        with_map(page)
        first_map = time.perf_counter() - began - interactive
    print(
        f"\nwritten in {written:.1f} s, {size:.1f} MB; sorted after {interactive:.2f} s, a map {first_map:.2f} s later"
    )
    assert written < 30.0
    assert size < 15.0
    assert interactive < 3.0
