"""Arrays that come in: masks, missing values and types that are no numbers."""

import ast
from collections.abc import Callable, Iterator
from decimal import Decimal
from itertools import pairwise
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pyarrow as pa
import pytest
import scipy.sparse
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from numpy.typing import ArrayLike
from scipy.sparse import csgraph

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.comparisons.statistics.hodges_lehmann import hodges_lehmann
from cgla_graph.comparisons.statistics.paired import cost_row, holm, signed_rank
from cgla_graph.errors import CglaError, GraphError, ProblemError
from cgla_graph.model.earth import LocalProjection
from cgla_graph.motion.trajectory import Trajectory
from cgla_graph.plots.profile import profile_of
from cgla_graph.refine.refine import refine_path
from cgla_graph.scenarios.geojson import line_feature_collection
from cgla_graph.scenarios.grid_map import GridMap
from cgla_graph.solvers.refine import Refine

ROOT = Path(__file__).parents[1]
FIELD = cg.RiskField([cg.Threat(0.5, 0.5, 0.1)])
PROBLEM = cg.Problem((0.0, 0.0), (1.0, 1.0), FIELD, k=1.0)
RASTER = cg.RasterRisk([[1.0, 2.0]], (0, 0, 2, 1))
ON_RASTER = cg.Problem((0, 0), (1, 1), cg.RiskField(rasters=[RASTER]), k=1.0)
EARTH = LocalProjection(25.0, 60.0)
PATH = np.array([(0.0, 0.0), (0.5, 0.25), (1.0, 1.0)])
MATRIX = np.array([[0.0, 2.0, 7.0], [2.0, 0.0, 3.0], [7.0, 3.0, 0.0]])
LEVELS = np.array([1.0, 2.0, 3.0])
GRAPH = cg.GeometricGraph.from_matrix(MATRIX)


def masked(array: ArrayLike, *places: object) -> Any:  # noqa: ANN401 - passes for any array
    """Mask some places, the last one if none is given; below the mask there is a number that would do."""
    found: Any = np.ma.array(array)
    for place in places or [(-1,) * found.ndim]:
        found[place] = np.ma.masked
    return found


def _bare_uses(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield where a parameter or field that takes any array is converted by numpy instead of by `_validate`."""
    for function in (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)):
        every = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
        names = {one.arg for one in every if one.annotation and "ArrayLike" in ast.unparse(one.annotation)}
        for call in (node for node in ast.walk(function) if isinstance(node, ast.Call) and node.args):
            of_numpy = ast.unparse(call.func).startswith("np.")
            if of_numpy and isinstance(call.args[0], ast.Name) and call.args[0].id in names:
                yield call.lineno, ast.unparse(call)


def test_numpy_converts_no_array_of_a_user() -> None:
    """Its `asarray` drops masks in silence."""
    found = [
        f"{file}:{line} {text}"
        for folder in ("cgla_graph", "solvers", "comparisons")
        for file in (ROOT / folder).rglob("*.py")
        if "ArrayLike" in (source := file.read_text())
        for line, text in _bare_uses(ast.parse(source))
        # (the checker of proofs stands alone, and reads arrays of files)
        if file.name not in {"_validate.py", "check_proof.py"}
    ]
    assert found == []


REFUSED: dict[str, Callable[[], object]] = {
    "threat": lambda: cg.Threat(0.1, 0.1, np.ma.masked),  # type: ignore[arg-type]
    "threat 0-d": lambda: cg.Threat(0.1, 0.1, np.ma.array(0.3, mask=True)),  # type: ignore[arg-type]
    "start": lambda: cg.Problem(masked([0.0, 0.0]), (1, 1)),
    "goal": lambda: cg.Problem((0, 0), masked([1.0, 1.0], 0)),
    "bounds": lambda: cg.Problem((0, 0), (1, 1), bounds=masked([0.0, 0.0, 1.0, 1.0])),
    "k": lambda: cg.Problem((0, 0), (1, 1), k=np.ma.masked),  # type: ignore[arg-type]
    "clearance": lambda: cg.Problem((0, 0), (1, 1), clearance=np.ma.masked),  # type: ignore[arg-type]
    "in_degrees": lambda: cg.Problem.in_degrees(masked([24.0, 60.0]), (25, 60), bounds=(23, 59, 26, 61)),
    "raster bounds": lambda: cg.RasterRisk([[1.0]], masked([0.0, 0.0, 1.0, 1.0])),
    "raster scale": lambda: cg.RasterRisk([[1.0]], (0, 0, 1, 1), scale=np.ma.masked),  # type: ignore[arg-type]
    "raster density": lambda: RASTER.density(masked(PATH)),
    "density": lambda: FIELD.density(masked(PATH)),
    "gradient": lambda: FIELD.gradient(masked(PATH)),
    "line_integral": lambda: FIELD.line_integral(PATH, masked(PATH)),
    "line_integral starts": lambda: FIELD.line_integral(masked(PATH), PATH),
    "evaluate": lambda: PROBLEM.evaluate(masked(PATH)),
    "evaluate a list": lambda: PROBLEM.evaluate([(0, 0), masked([0.5, 0.5]), (1, 1)]),
    "evaluate constants": lambda: PROBLEM.evaluate([(0, 0), (0.5, np.ma.masked), (1, 1)]),
    "in_bounds": lambda: PROBLEM.in_bounds(masked(PATH)),
    "stretch": lambda: cg.Problem.in_degrees((24, 60), (25, 60), bounds=(23, 59, 26, 61)).stretch(masked(PATH)),
    "crosses": lambda: cg.NoFlyArea(None).crosses(PATH, masked(PATH)),
    "contains": lambda: cg.NoFlyArea(None).contains(masked(PATH)),
    "path_clearance": lambda: cg.NoFlyArea(None).path_clearance(masked(PATH)),
    "weights": lambda: PROBLEM.model.weights(PATH, masked(PATH)),
    "row": lambda: PROBLEM.model.row(masked(PATH), 0),
    "pair": lambda: PROBLEM.model.pair(masked(PATH), 0, 1),
    "matrix": lambda: PROBLEM.model.matrix(masked(PATH)),
    "complete": lambda: cg.GeometricGraph.complete(masked(PATH)),
    "extra": lambda: cg.GeometricGraph.complete(PATH, extra=[masked([0.5, 0.5])]),
    "from_matrix positions": lambda: cg.GeometricGraph.from_matrix(MATRIX, positions=masked(PATH)),
    "from_sparse positions": lambda: cg.GeometricGraph.from_sparse(
        scipy.sparse.csr_array(MATRIX), positions=masked(PATH)
    ),
    "from_networkx positions": lambda: cg.GeometricGraph.from_networkx(
        _networkx(weight=1.0, pos=masked([0.5, 0.5])), weight="weight"
    ),
    "lower_bound": lambda: cg.lower_bound(PROBLEM, path=masked(PATH)),
    "tolerance": lambda: cg.lower_bound(PROBLEM, np.ma.masked),  # type: ignore[arg-type]
    "refine_path": lambda: refine_path(PROBLEM, masked(PATH)),
    "Refine": lambda: cg.solve(PROBLEM, Refine(base=masked(PATH))),
    "profile_of": lambda: profile_of(PROBLEM, masked(PATH)),
    "times": lambda: Trajectory(masked(LEVELS), PATH),
    "points": lambda: Trajectory(LEVELS, masked(PATH)),
    "along": lambda: Trajectory.along(masked(PATH), 0.0, 1.0),
    "forward": lambda: EARTH.forward(masked([[24.0, 60.0]])),
    "inverse": lambda: EARTH.inverse(masked(PATH)),
    "levels": lambda: cg.density_front(ON_RASTER, levels=masked(LEVELS)),
    "level": lambda: cg.below_density(ON_RASTER, np.ma.masked),  # type: ignore[arg-type]
    "max_risk": lambda: cg.plan_within_risk(PROBLEM, np.ma.masked),  # type: ignore[arg-type]
    "max_length": lambda: cg.plan_within_length(PROBLEM, np.ma.masked),  # type: ignore[arg-type]
    "k_max": lambda: cg.pareto(PROBLEM, k_max=np.ma.masked),  # type: ignore[arg-type]
    "check": lambda: cg.check(masked(PATH), PROBLEM),
    "plan": lambda: cg.FlightPlan.along(masked([[24.0, 60.0], [25.0, 60.0]])),
    "waypoint": lambda: cg.Waypoint(24.0, np.ma.masked),  # type: ignore[arg-type]
    "altitude": lambda: cg.Waypoint(24.0, 60.0, altitude=np.ma.masked),  # type: ignore[arg-type]
    "turn_radius": lambda: cg.flyable(cg.solve(PROBLEM, "straight-line"), np.ma.masked),  # type: ignore[arg-type]
    "heading": lambda: cg.flyable(cg.solve(PROBLEM, "straight-line"), 0.1, start_heading=np.ma.masked),  # type: ignore[arg-type]
    "uav": lambda: cg.Uav("a", masked([0.0, 0.0]), (1, 1), 0.1),
    "uav k": lambda: cg.Uav("a", (0, 0), (1, 1), 0.1, k=np.ma.masked),  # type: ignore[arg-type]
    "radius": lambda: cg.Uav("a", (0, 0), (1, 1), np.ma.masked),  # type: ignore[arg-type]
    "moves": lambda: cg.TimedThreat(FIELD.threats[0], moves=[(1, 0.5, np.ma.masked)]),
    "loss": lambda: cg.Sharing(loss=np.ma.masked),  # type: ignore[arg-type]
    "heard": lambda: cg.Sharing(radius=1.0).heard(0, masked(PATH)),
    "virtual obstacle": lambda: cg.VirtualObstacle(spread=np.ma.masked),  # type: ignore[arg-type]
    "arrival": lambda: cg.Mission(
        cg.World(), [cg.Uav("a", (0, 0), (1, 1), 0.1)], cg.solvers.get("cgla"), arrival_radius=np.ma.masked
    ),  # type: ignore[arg-type]
    "world": lambda: cg.World(bounds=masked([0.0, 0.0, 1.0, 1.0])),
    "lattice": lambda: cg.Lattice(3, bounds=masked([0.0, 0.0, 1.0, 1.0])),
    "grid map": lambda: GridMap("map", masked([[True, False]])),
    "line": lambda: line_feature_collection(masked([[24.0, 60.0]]), {}),
    "ground_risk": lambda: cg.ground_risk(
        RASTER, unit="people/km2", failures_per_hour=np.ma.masked, speed=10.0, lethal_area=1.0
    ),  # type: ignore[arg-type]
    "risk_weight": lambda: cg.risk_weight(prevented_fatality=np.ma.masked, metre=1.0),  # type: ignore[arg-type]
    "area_above": lambda: RASTER.area_above(np.ma.masked),  # type: ignore[arg-type]
    "saved path": lambda: cg.Solution(cg.Status.FOUND, path=masked(PATH)).save("never.csv"),
    "cost_row": lambda: cost_row("a", masked(LEVELS)),
    "holm": lambda: holm(masked(LEVELS / 10.0)),
    "signed_rank": lambda: signed_rank(masked(LEVELS)),
    "hodges_lehmann": lambda: hodges_lehmann(masked(LEVELS)),
}


def _networkx(*, weight: object, pos: object = None) -> "nx.Graph[int]":
    graph: nx.Graph[int] = nx.path_graph(2)
    graph.edges[0, 1]["weight"] = weight
    for node in graph:
        graph.nodes[node]["pos"] = pos
    return graph


@pytest.mark.parametrize("door", REFUSED)
def test_masked_places_are_refused_by_name(door: str) -> None:
    with pytest.raises(CglaError, match=r"mask") as caught:
        REFUSED[door]()
    assert "\n" not in str(caught.value)
    assert "; " in str(caught.value)


def test_the_message_tells_where_and_what_to_do() -> None:
    with pytest.raises(
        ProblemError, match=r"path is masked in 2 places, the first at index \(1, 1\).*filled.*compressed"
    ):
        PROBLEM.evaluate(masked(PATH, (1, 1), (2, 0)))


def test_a_mask_without_masked_places_is_no_mask() -> None:
    whole = np.ma.array(PATH, mask=np.zeros(PATH.shape, dtype=bool))
    assert PROBLEM.evaluate(whole) == PROBLEM.evaluate(np.ma.array(PATH)) == PROBLEM.evaluate(PATH)
    assert cg.Problem(np.ma.array((0.0, 0.0)), (1, 1)).start == (0.0, 0.0)  # type: ignore[arg-type]


weights = arrays.arrays(
    np.float64, st.integers(2, 6).map(lambda n: (n, n)), elements=st.sampled_from([0.0, 0.5, 1.0, 2.0, 5.0])
)


@given(weights, st.data())
def test_a_masked_weight_is_no_edge(matrix: FloatArray, data: st.DataObject) -> None:
    """The idiom of scipy.sparse.csgraph's manual, whose answer is the oracle; the data below masks play no part."""
    mask = data.draw(arrays.arrays(np.bool_, matrix.shape))
    below = np.where(mask, data.draw(st.sampled_from([-1.0, 0.0, np.nan, np.inf, 1e300])), matrix)
    given_matrix = np.ma.array(below, mask=mask)
    dense = cg.GeometricGraph.from_matrix(given_matrix)
    plain = cg.GeometricGraph.from_matrix(np.where(mask, np.inf, matrix))
    assert np.array_equal(dense.weight_matrix(), plain.weight_matrix())
    nowhere: Any = csgraph.csgraph_from_dense(np.where(mask, np.inf, matrix), null_value=np.inf)
    least = csgraph.dijkstra(nowhere, indices=0)
    found = [cg.cost_matrix(dense, target).value(0) for target in range(len(matrix))]
    assert np.allclose(found, least, rtol=1e-12)
    rows = cg.GeometricGraph.from_matrix([np.ma.array(row) for row in given_matrix])
    assert np.array_equal(rows.weight_matrix(), plain.weight_matrix())


@pytest.mark.parametrize("kind", ["csr", "csc", "coo", "bsr", "dia"])
def test_a_masked_stored_weight_is_no_edge(kind: str) -> None:
    matrix = scipy.sparse.csr_array(MATRIX).asformat(kind)
    matrix.data = np.ma.masked_equal(matrix.data, 7.0)
    graph = cg.GeometricGraph.from_sparse(matrix)
    assert graph.weights_from(0).tolist() == [0.0, 2.0, np.inf]
    assert isinstance(matrix.data, np.ma.MaskedArray)


def test_a_masked_dense_matrix_for_scipy_leaves_out_its_masked_weights() -> None:
    graph = cg.GeometricGraph.from_sparse(np.ma.masked_equal(MATRIX, 7.0))
    assert graph.weights_from(0).tolist() == [0.0, 2.0, np.inf]


def test_a_masked_attribute_of_an_edge_is_no_edge() -> None:
    for weight in (np.ma.masked, np.ma.array(3.0, mask=True)):
        assert cg.GeometricGraph.from_networkx(_networkx(weight=weight)).n_edges == 0
    assert cg.GeometricGraph.from_networkx(_networkx(weight=np.ma.array(3.0))).weight(0, 1) == 3.0


def test_a_masked_cell_has_no_data() -> None:
    values = np.ma.masked_equal([[1.0, 2.0], [-9999.0, 4.0]], -9999.0)
    with pytest.raises(
        ProblemError, match=r"1 cells .* no data, the first in row 1, column 0; give its value with nodata"
    ):
        cg.RasterRisk(values, (0, 0, 2, 2))
    raster = cg.RasterRisk(values, (0, 0, 2, 2), nodata=7.0)
    assert raster.cells.tolist() == [[7.0, 4.0], [1.0, 2.0]]
    assert raster.missing.tolist() == [[False, False], [True, False]]
    whole = cg.RasterRisk(np.ma.masked_equal([[1, 2], [3, 4]], 3), (0, 0, 2, 2), nodata=7.0)
    assert whole.cells.tolist() == [[7.0, 4.0], [1.0, 2.0]]
    with pytest.raises(ProblemError, match="no data: all of its values"):
        cg.RasterRisk(np.ma.masked_all((2, 2)), (0, 0, 2, 2), nodata=7.0)


@pytest.mark.parametrize(
    ("matrix", "says"),
    [
        (MATRIX > 0.0, "type bool"),
        (MATRIX.astype(complex), "type complex128"),
        (MATRIX.astype("datetime64[s]"), "type datetime64"),
        (MATRIX.astype("timedelta64[s]"), "type timedelta64"),
        (MATRIX.astype(str), "type <U"),
        (MATRIX.astype(str).astype(object), "type str"),
        ((MATRIX > 0.0).astype(object), "type bool"),
        (np.where(MATRIX > 5.0, 10**400, MATRIX.astype(object)), "too large"),
        (np.where(MATRIX > 5.0, Decimal("1e400"), MATRIX.astype(object)), "too large"),
        (np.array([[0, np.longdouble("1e400")], [1, 0]]), "too large"),
        (np.where(MATRIX > 5.0, None, MATRIX.astype(object)), "weight nan"),
        ([pa.array([0.0, None]), [1.0, 0.0]], "weight nan"),
        (scipy.sparse.csr_array(MATRIX), "from_sparse"),
        (np.zeros(2, dtype=[("weight", float)]), "type"),
        (np.array(1.0), "shape"),
    ],
)
def test_weights_that_are_no_numbers_are_refused(matrix: ArrayLike, says: str) -> None:
    with pytest.raises(GraphError, match=says):
        cg.GeometricGraph.from_matrix(matrix)


@pytest.mark.parametrize(
    "weight", [True, "1", 1j, None, Decimal("1e400"), np.longdouble("1e400"), np.array("1"), [1.0]]
)
def test_attributes_that_are_no_weights_are_refused(weight: object) -> None:
    graph = nx.Graph()
    graph.add_edge("a", "b", weight=weight)
    with pytest.raises(GraphError, match="edge 'a' - 'b' has weight"):
        cg.GeometricGraph.from_networkx(graph)


@pytest.mark.parametrize(
    "number", [True, "1", 1j, np.array("1"), np.array(np.True_), np.array([1.0]), Decimal("1e400")]
)
def test_numbers_of_other_types_are_refused(number: object) -> None:
    with pytest.raises(ProblemError, match=r"k is .*; give a finite number"):
        cg.Problem((0, 0), (1, 1), k=number)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "form",
    [
        np.asfortranarray,
        lambda array: array.astype(">f8"),
        lambda array: array.astype(np.float16),
        lambda array: array.astype(np.longdouble),
        lambda array: array.astype(np.uint8),
        lambda array: array.astype(object),
        lambda array: np.repeat(array, 2, axis=1)[:, ::2],
        np.ndarray.tolist,
        lambda array: [pa.array(row) for row in array],
        lambda array: [[Decimal(int(value)) for value in row] for row in array],
    ],
)
def test_other_layouts_of_numbers_are_the_same_weights(form: Callable[[Any], Any]) -> None:
    given_matrix = form(MATRIX)
    if isinstance(given_matrix, np.ndarray):
        given_matrix.flags.writeable = False
    graph = cg.GeometricGraph.from_matrix(given_matrix)
    assert np.array_equal(graph.weight_matrix(), MATRIX)
    assert all(cg.solve(cg.GraphProblem(graph, i, j), "dijkstra").cost <= MATRIX[i, j] for i, j in pairwise(range(3)))
