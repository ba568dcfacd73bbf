"""Claims on a user's own settings: what is flown, what is said, and that a study never mixes with it."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Call, caller
from hypothesis import given
from hypothesis import strategies as st

import cgla_graph as cg
from cgla_graph.comparisons.claims import catalogue, headlines, own, page, summary
from cgla_graph.comparisons.claims.evidence import Samples, Scale
from cgla_graph.comparisons.claims.panel import arrivals, company, complexity, flights, single_uav, teams
from cgla_graph.comparisons.claims.panel.settings import FACTORS, KINDS, PANEL, Panel, PanelMap, across, seeds_of
from cgla_graph.comparisons.claims.paper import bcv_claims, weight_claims
from cgla_graph.comparisons.claims.rule import judged, pairs_of
from cgla_graph.comparisons.claims.statement import Rate, Share, Shift, Statement, Within
from cgla_graph.comparisons.claims.store import FILE, Store
from cgla_graph.errors import ClaimError, OutputError, ProblemError
from cgla_graph.model.risk import RiskField


@pytest.fixture
def cgla(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    return caller(tmp_path, monkeypatch, capfd)


levels = st.fixed_dictionaries(
    {},
    optional={
        "k": st.sets(st.floats(0.0, 1e6), min_size=1, max_size=4),
        "threats": st.sets(st.integers(1, 100), min_size=1, max_size=3),
        "radius": st.sets(st.floats(0.02, 1.3), min_size=1, max_size=4),
    },
)


@given(levels.filter(bool))
def test_every_level_is_flown_in_few_settings_and_maps_are_apart(given_: dict[str, set[Any]]) -> None:
    panel = own.own_panel(**given_)
    assert {name: set(of) for name, of in panel.own.items()} == given_
    seeds = [seed for kind in panel.kinds for seed in seeds_of(kind, 3, 2, panel)]
    assert len(seeds) == len(set(seeds)) == 2 * len(panel.kinds)
    for kind in panel.kinds:
        assert PanelMap(seeds_of(kind, 3, 2, panel)[1], panel).kind == kind
    for index, kind in enumerate(teams.half(panel)):
        cases = teams.fraction(index, panel)
        assert {case["radius"] for case in cases} == set(panel.levels("radius"))
        assert {case["k"] for case in cases} == set(panel.levels("k"))
        assert kind.threats in panel.levels("threats")
    # every number of threats, and each kind of the others, is in the half
    assert {kind.threats for kind in teams.half(panel)} == set(panel.levels("threats"))
    met = across(panel.levels("radius"), panel.levels("k"), shift=7)
    assert len(met) == len(set(met))


def test_the_levels_of_the_study_given_as_own_ones_make_the_same_maps_and_cells() -> None:
    panel = Panel(dict(FACTORS))
    assert panel.kinds == KINDS
    for kind in KINDS:
        assert seeds_of(kind, 2, 3, panel) == seeds_of(kind, 2, 3)
        (seed,) = seeds_of(kind, 2, 1)
        assert PanelMap(seed, panel).field == PanelMap(seed).field
    assert teams.half(panel) == teams.half(PANEL)
    assert [teams.fraction(index, panel) for index in range(4)] == [teams.fraction(index) for index in range(4)]
    assert {one.text for one in weight_claims.statements(panel)} == {one.text for one in weight_claims.statements()}


def test_a_map_is_flown_at_own_levels_only_and_nothing_is_varied() -> None:
    panel = own.own_panel(k=[0.5, 3], threats=4, radius=0.3)
    map_ = PanelMap(seeds_of(panel.kinds[0], 1, 1, panel)[0], panel)
    assert len(map_.field) == 4
    assert map_.levels["threats"] == 4
    flown = flights.settings_of(map_, single_uav.FLOWN, single_uav.CONSTANTS)
    assert {(one.radius, one.k, one.varied) for one in flown} == {(0.3, 0.5, ""), (0.3, 3.0, "")}
    assert len(flown) == 2 * len(single_uav.FLOWN)
    records = complexity.new_threat.sample(map_)
    assert {(one["k"], one["threats"]) for one in records} == {(0.5, 4), (3.0, 4)}


@pytest.mark.slow
def test_a_pair_of_uavs_and_three_of_them_fly_however_far_they_see() -> None:
    """Safe distances follow the radius, and stay below the distance of the starts."""
    for radius in own.ALLOWED["radius"][:2]:
        panel = own.own_panel(k=0, threats=1, radius=radius)
        map_ = PanelMap(seeds_of(panel.kinds[0], 1, 1, panel)[0], panel)
        for course in arrivals.COURSES:
            arrivals.fly_pair(RiskField(), course, 0.02, 6, radius=radius, k=0.0)
        for case in teams.fraction(0, panel):
            assert teams.kept_apart(map_, RiskField(), 3, case, n=6).all_arrived
        assert teams.fly_two(map_, RiskField(), k=0.0, radius=radius, n=6).all_arrived
        (cgla_flies, *_) = flights.settings_of(map_, company.COMPANY, ())
        assert all(one["arrived"] for one in company._Team(map_).records(cgla_flies))


def test_k_of_a_claim_gives_way_to_a_user_s() -> None:
    records = [
        {"map": i, "mode": "flown", "planner": planner, "radius": 0.2, "k": k, "risk": risk + 0.01 * i}
        for i in range(8)
        for k in (0.5, 3.0)
        for planner, risk in (("cgla", 1.0), ("bcv-style, risk_aversion 0", 2.0))
    ]
    here = own.own_panel(k=[0.5, 3])
    for panel, count in ((here, 2), (PANEL, 0)):
        less_risk = bcv_claims.against_bcv("length only", panel)[0]
        assert len(pairs_of(Samples(records), less_risk)) == count
    texts = [one.text for one in weight_claims.statements(own.own_panel(k=[0, 2]))]
    assert texts[0] == "less risk in flight, K = 2 against 0"
    assert len(texts) == 3


@pytest.mark.parametrize("name", ["k", "threats", "radius"])
@pytest.mark.parametrize(
    "value", [-1, math.nan, math.inf, 1e9, "0.5", True, [], [0.5, None], list(np.linspace(0.1, 1, 40)), {}, b"1"]
)
def test_nonsense_is_refused_with_what_is_allowed(name: str, value: Any) -> None:  # noqa: ANN401 - anything
    with pytest.raises(ProblemError, match=rf"^{name} is .*; give 1 to 10 (whole )?numbers from"):
        own.own_panel(**{name: value})


@pytest.mark.parametrize(
    ("name", "value"), [("threats", 0), ("threats", 5.5), ("threats", 101), ("radius", 0.0), ("radius", 20.0)]
)
def test_limits_are_those_that_are_said(name: str, value: float) -> None:
    least, most, _ = own.ALLOWED[name]
    with pytest.raises(ProblemError, match=f"from {least:g} to {most:g}"):
        own.own_panel(**{name: value})
    assert own.own_panel(**{name: [most, least]}).own[name] == (least, most)
    assert own.own_panel(**{name: np.array([least])}).own[name] == (least,)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["eight-direction", "--k", "2"], "did you mean eight-directions"),
        (["C99", "--k", "2"], "claims: C1 to C55"),
        (["--k", "2"], "name the claims"),
        (["C16", "--k", "2", "--radius", "0.3"], "C16 has no k and no radius, and is not run: it has none of"),
        (["C25", "--radius", "0.3"], "C25 has no radius, and is not run: it has k and threats"),
        (["C28", "--k", "2"], "C28 compares values of k, and is not run: give 2 or more"),
        (["C26", "--k", "2,x"], "k is '2,x'; give 1 to 10 numbers"),
        (["C26", "--k", ""], "k is ''; give"),
        (["C26", "--threats", "5.5"], "threats is 5.5; give 1 to 10 whole numbers from 1 to 100"),
        (["C26", "--radius", "20"], "from 0.02 to 1.3 in map units"),
        (["--list", "--radius", "0.3"], "--list shows the study; leave out --radius"),
    ],
)
def test_the_command_says_in_one_line_what_is_wrong(cgla: Call, arguments: list[str], said: str) -> None:
    done = cgla("claims", *arguments)
    assert done.code == 2
    assert said in done.err
    assert len(done.err.strip().splitlines()) == 1
    assert not done.out


def test_python_and_the_command_give_the_same_numbers_beside_the_study_s(
    tmp_path: Path, cgla: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    # the same, but smaller
    monkeypatch.setattr(complexity, "N", 8)
    monkeypatch.setattr(complexity, "NEW_THREAT_SIZES", (8,))
    arguments = ("C23", "C16", "--k", "2", "--threats", "3", "--radius", "0.3", "--quick", "--workers", "0")
    done = cgla("claims", *arguments, "--json", "--out", str(tmp_path / "a"))
    assert done.code == 0, done.err
    found = json.loads(done.out)
    called = cg.comparisons.claims_on(["C23", "C16"], k=2, threats=3, radius=0.3, quick=True, workers=0)
    for one in (*found["claims"], *called["claims"]):
        one.pop("seconds")
    assert found == json.loads(json.dumps(called))
    assert found[page.OWN] == {"k": [2.0], "threats": [3], "radius": [0.3]}
    (claim,) = found["claims"]
    assert set(claim["settings"]) == {"k", "threats"}
    assert claim["settings"]["k"]["values"] == [2.0]
    assert claim["rerun"] == "cgla claims C23 --k 2 --threats 3 --radius 0.3 --quick"
    shipped = {one["id"]: one["rows"] for one in summary.shipped_verdicts()["claims"]}
    assert claim["study"]["rows"] == shipped["C23"]
    assert [one.partition(",")[0] for one in found["remarks"]] == [
        "C16 has no k and no threats and no radius",
        "C23 has no radius",
    ]
    # files say what they are
    report = (tmp_path / "a" / "report.md").read_text(encoding="utf-8")
    assert report.startswith("# Claims on own settings: no verdicts on the paper")
    assert "In the study" in report
    assert "no verdicts" in (tmp_path / "a" / "report.html").read_text(encoding="utf-8").partition("</title>")[0]
    assert json.loads((tmp_path / "a" / "claims.json").read_text(encoding="utf-8"))[page.OWN]
    assert not (tmp_path / "a" / "figures").exists()
    # what is asked for again goes on, other settings do not
    assert cgla("claims", *arguments, "--out", str(tmp_path / "a"), "--resume").code == 0
    other = cgla("claims", "C23", "--k", "7", "--quick", "--out", str(tmp_path / "a"), "--resume")
    assert (other.code, "never mixed" in other.err) == (2, True)


def test_a_folder_holds_a_study_or_own_settings_and_never_both(tmp_path: Path) -> None:
    here, there = Scale(panel=own.own_panel(k=2)), Scale(panel=own.own_panel(k=3))
    with Store(tmp_path / "own", here), Store(tmp_path / "study", Scale()):
        pass
    for folder, scale in (("own", Scale()), ("study", here), ("own", there)):
        with pytest.raises(OutputError, match="never mixed with"):
            Store(tmp_path / folder, scale, resume=True)
    for folder, scale in (("own", Scale()), ("study", here)):
        with pytest.raises(OutputError, match="never mixed with"):
            Store(tmp_path / folder, scale, overwrite=True)
    with Store(tmp_path / "own", here, resume=True), Store(tmp_path / "study", Scale(), resume=True):
        pass
    with Store(tmp_path / "own", there, overwrite=True):
        pass
    assert '"k":[3.0]' in (tmp_path / "own" / FILE).read_text(encoding="utf-8")


def test_the_page_and_the_shipped_answers_refuse_own_settings() -> None:
    study = summary.shipped_verdicts()
    marked = {page.OWN: {"k": [2.0]}, **study}
    pages = f"{summary.BEGIN}\n{summary.END}"
    assert summary.with_answers(pages, study) != pages
    refused = pytest.raises(ClaimError, match=r"own settings \(k 2.0\)")
    with refused:
        summary.with_answers(pages, marked)
    with refused:
        summary.shortened(marked)
    with refused:
        summary.contradictions(study, marked)


@pytest.mark.parametrize(
    ("test", "draw", "truth"),
    [
        (Shift(), lambda rng, n: rng.normal(math.log(0.8), 0.5, n), 0.8),
        (Shift(ratio=False), lambda rng, n: rng.normal(2.0, 3.0, n), 2.0),
        (Within(0.1), lambda rng, n: rng.normal(math.log(1.05), 0.2, n), 1.05),
        (Share(0.95), lambda rng, n: (rng.random(n) < 0.9).astype(float), 0.9),
        (Rate(), lambda rng, n: (rng.random(n) < 0.3).astype(float) - (rng.random(n) < 0.1).astype(float), 0.2),
    ],
)
def test_an_interval_covers_the_truth_on_95_of_100_samples(test: Any, draw: Any, truth: float) -> None:  # noqa: ANN401
    rng, covered = np.random.default_rng(4), 0
    for _ in range(400):
        size, low, high = test.estimate(draw(rng, 40))
        assert low <= size <= high
        covered += low <= truth <= high
    assert covered >= 0.93 * 400


def test_nothing_is_known_of_an_interval_from_few_maps() -> None:
    records = [{"map": i, "k": k, "risk": i + k} for i in range(4) for k in (1.0, 2.0)]
    of = Statement("more", "risk", {"k": 2.0}, {"k": 1.0}, less=False, factors=(), size="{} % more")
    assert "(95 %: unknown from 4 maps) % more" in judged(Samples(records), of).interval
    never = [{"map": i, "k": k, "risk": 0.0} for i in range(4) for k in (1.0, 2.0)]
    # that none was seen on four maps does not mean that it never happens
    _, low, high = Rate().estimate(np.zeros(4))
    assert low < -0.3 < 0.3 < high
    assert judged(Samples(never), of).interval.startswith("0 (95 %: unknown")


def test_settings_are_declared_where_experiments_have_them() -> None:
    """A claim with maps of the panel has a setting, and one without any is decided by no map."""
    free = {claim.id for claim in catalogue.claims().values() if not claim.settings}
    assert not {claim.id for claim in catalogue.claims().values() if claim.experiments} & free
    asked = own.asked_for(["C1-C55"], own.own_panel(k=[1, 2], threats=3, radius=0.2))
    assert {claim.id for claim in asked.claims} == set(catalogue.claims()) - free
    for claim in asked.claims:
        for name, setting in claim.settings.items():
            assert setting.means
            assert all(own.ALLOWED[name][0] <= one <= own.ALLOWED[name][1] for one in setting.usual)


def test_headlines_stay_the_study_s() -> None:
    assert not headlines.unanswered(summary.shipped_verdicts())
