"""Rasters in files: every format says the same, totals stay when degrees become metres, every fault is one line."""

import gzip
import io
import re
import warnings
import zipfile
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from raster_files import ASC, BOX, VALUES, geotiff, refused, total
from strategies import examples, few

from cgla_graph.errors import ProblemError
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.rasters import reading
from cgla_graph.model.rasters import values as values_module
from cgla_graph.model.rasters.crs import RasterWarning
from cgla_graph.model.rasters.projection import areas_of_rows
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.scenarios.loading import open_scenarios

ARUBA = Path(__file__).resolve().parents[3] / "shared/data/ground_risk/aruba_worldpop_2020.tif"


def test_every_format_says_the_same(tmp_path: Path) -> None:
    expected = RasterRisk(VALUES, BOX)
    rows = "\n".join(",".join(map(str, row)) for row in VALUES.tolist())
    (tmp_path / "a.csv").write_text(rows)
    (tmp_path / "b.csv.gz").write_bytes(gzip.compress(rows.encode()))
    np.save(tmp_path / "c.npy", VALUES)
    np.savez_compressed(tmp_path / "d.npz", VALUES)
    for file in sorted(tmp_path.iterdir()):
        assert RasterRisk.from_file(file, bounds=BOX) == expected
    assert RasterRisk.from_file(tmp_path / "c.npy", bounds=BOX, origin="lower") == RasterRisk(
        VALUES, BOX, origin="lower"
    )
    (tmp_path / "e.asc").write_text(ASC + rows.replace(",", " "))
    assert RasterRisk.from_file(tmp_path / "e.asc") == expected
    centred = ASC.replace("corner 10", "center 15").replace("corner 20", "center 25")
    (tmp_path / "f.asc").write_text(centred + rows.replace(",", " "))
    assert RasterRisk.from_file(tmp_path / "f.asc") == expected


@given(values=arrays(np.float64, (3, 4), elements=st.floats(0.0, 1e6)))
@few
def test_text_keeps_every_bit(values: np.ndarray, tmp_path_factory: pytest.TempPathFactory) -> None:
    file = tmp_path_factory.mktemp("text") / "a.csv"
    file.write_text("\n".join(",".join(map(repr, row)) for row in values.tolist()))
    assert RasterRisk.from_file(file, bounds=BOX) == RasterRisk(values, BOX)


def test_nodata_is_refused_unless_it_is_said_what_it_stands_for(tmp_path: Path) -> None:
    file = tmp_path / "a.asc"
    file.write_text(ASC + "1 2 -9\n4 5 6\n")
    refused(file, "1 of its cells have no data, the first in row 0, column 2; give .* nodata")
    assert RasterRisk.from_file(file, nodata=0.0).missing.sum() == 1
    assert RasterRisk.from_file(file, nodata=0.0, kind="count").greatest == 6.0 / 100.0


@given(
    values=arrays(np.float64, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.floats(0.0, 100.0)),
    west=st.floats(-179.0, 179.0),
    south=st.floats(-85.0, 85.0),
    size=st.floats(0.001, 0.3),
    kind=st.sampled_from(["count", "density"]),
)
@examples(40)
def test_totals_stay(
    values: np.ndarray, west: float, south: float, size: float, kind: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    values[0, 0] += 1.0
    rows, columns = values.shape
    box = (west, south, west + columns * size, south + rows * size)
    file = tmp_path_factory.mktemp("lonlat") / "a.npy"
    np.save(file, values)
    projection = LocalProjection((west + 180.0 + 0.1) % 360.0 - 180.0, south + 0.1)
    raster = RasterRisk.from_file(file, bounds=box, kind=kind, projection=projection)
    lons, lats = np.linspace(box[0], box[2], columns + 1), np.linspace(box[3], box[1], rows + 1)
    expected = 0.0
    for row in range(rows):
        for column in range(columns):
            cell = shapely.box(lons[column], lats[row + 1], lons[column + 1], lats[row])
            ring = shapely.get_coordinates(cell)
            ring[:, 0] = (ring[:, 0] + 180.0) % 360.0 - 180.0
            area = shapely.Polygon(projection.forward(ring)).area
            expected += values[row, column] * (1.0 if kind == "count" else area)
    assert total(raster) == pytest.approx(expected, rel=1e-6)


def test_the_people_of_a_cell_stay_where_they_are(tmp_path: Path) -> None:
    values = np.zeros((20, 30))
    values[4, 21] = 500.0
    np.save(tmp_path / "a.npy", values)
    projection = LocalProjection(25.0, 60.0)
    raster = RasterRisk.from_file(
        tmp_path / "a.npy",
        bounds=(24.7, 59.9, 25.3, 60.1),
        kind="count",
        projection=projection,
        interpolation="nearest",
    )
    (x, y) = projection.forward((24.7 + 21.5 * 0.02, 60.1 - 4.5 * 0.01))
    assert raster.density((x, y)) == raster.greatest > 0.0
    assert raster.density((x + 3000.0, y)) == raster.density((x, y - 3000.0)) == 0.0


def test_real_people_are_all_there() -> None:
    pytest.importorskip("rasterio")
    if not ARUBA.exists():
        pytest.skip("needs ../shared/data/ground_risk")
    people = RasterRisk.from_file(ARUBA, kind="count", nodata=0.0)
    assert total(people) == pytest.approx(106_766.0, rel=1e-3)
    refused(ARUBA, "50846 of its cells have no data")


@pytest.mark.filterwarnings("ignore:Dataset has no geotransform")
def test_geotiffs(tmp_path: Path) -> None:
    metric = geotiff(tmp_path / "a.tif", VALUES, 10.0, 40.0, 10.0, "EPSG:32635")
    assert RasterRisk.from_file(metric) == RasterRisk(VALUES, BOX)
    refused(metric, "leave out bounds", bounds=BOX)
    refused(metric, "EPSG:4326", projection=LocalProjection(25.0, 60.0))
    bare = geotiff(tmp_path / "b.tif", VALUES, 0.0, 0.0, 1.0, None, transform=None)
    refused(bare, "give bounds")
    assert RasterRisk.from_file(bare, bounds=BOX) == RasterRisk(VALUES, BOX)
    from rasterio.transform import Affine  # noqa: PLC0415 - needs rasterio

    turned = geotiff(tmp_path / "c.tif", VALUES, 0, 0, 1, "EPSG:32635", transform=Affine(1, 0.5, 0, 0.5, -1, 0))
    refused(turned, "rotated")
    refused(geotiff(tmp_path / "f.tif", np.stack([VALUES, VALUES]), 10.0, 40.0, 10.0, "EPSG:32635"), "2 bands")
    whole = metric.read_bytes()
    (tmp_path / "g.tif").write_bytes(whole[: len(whole) // 2])
    refused(tmp_path / "g.tif", "damaged")
    empty = geotiff(tmp_path / "h.tif", np.full((2, 3), -9.0), 10.0, 40.0, 10.0, "EPSG:32635", nodata=-9.0)
    refused(empty, "holds no data")
    # no block of it is written
    huge = tmp_path / "i.tif"
    import rasterio  # noqa: PLC0415 - may be missing

    size = {"width": 20_000, "height": 10_000, "count": 1, "dtype": "uint8", "transform": Affine(2, 0, 9, 0, -2, 9)}
    with rasterio.open(huge, "w", driver="GTiff", crs="EPSG:32635", sparse_ok=True, **size):
        pass
    refused(huge, "10000 x 20000 cells, more than 120000000")


@pytest.mark.parametrize("kind", ["uint8", "int16", "uint16", "int32", "float32", "float64"])
@pytest.mark.parametrize("how", [{}, {"compress": "deflate", "blockysize": 7}, {"tiled": True, "compress": "lzw"}])
def test_rows_of_blocks_are_read_one_after_the_other(
    kind: str, how: dict[str, object], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rasterio = pytest.importorskip("rasterio")
    monkeypatch.setattr(values_module, "AT_ONCE", 4000)
    monkeypatch.setattr(reading, "AT_ONCE", 4000)
    cells = np.random.default_rng(3).gamma(0.5, 9.0, (300, 290)).clip(0.0, 100.0).astype(kind)
    cells[250:, 100:120], cells[3, 5] = 120, 120
    size = {"blockxsize": 32, "blockysize": 48} if "tiled" in how else {}
    file = geotiff(tmp_path / "a.tif", cells, 5e5, 6.7e6, 10.0, "EPSG:32635", nodata=120, **{**size, **how})
    raster = RasterRisk.from_file(file, nodata=0.1)
    with rasterio.open(file) as opened:
        expected = opened.read(1, masked=True).astype(np.float64)
    assert np.array_equal(raster.values, expected.filled(np.nan), equal_nan=True)
    assert np.array_equal(raster.cells[::-1], expected.filled(0.1))
    assert raster.missing.sum() == 50 * 20 + 1
    refused(file, "1001 of its cells have no data, the first in row 3, column 5")
    counts = RasterRisk.from_file(file, nodata=0.1, kind="count")
    areas = areas_of_rows(counts.bounds, cells.shape, counts.system)(slice(None))[::-1]
    assert np.array_equal(counts.cells[::-1], expected.filled(0.1) / areas)
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 2])
    refused(file, "damaged")


def test_numbers_of_another_kind_are_faults_wherever_they_are(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("rasterio")
    monkeypatch.setattr(values_module, "AT_ONCE", 100)
    cells = np.ones((300, 30), dtype=np.float32)
    cells[170, 3], cells[171, 4], cells[299, 29] = -1.0, np.inf, -2.0
    file = geotiff(tmp_path / "a.tif", cells, 5e5, 6.7e6, 10.0, "EPSG:32635")
    refused(file, "3 of its values are no risk, the first is -1 in row 170, column 3")
    with pytest.raises(ProblemError, match="3 values of the raster are no risk, the first is -1 in row 170, column 3"):
        RasterRisk(cells, (0, 0, 1, 1))


def test_blocks_that_fill_the_memory_are_refused(tmp_path: Path) -> None:
    rasterio = pytest.importorskip("rasterio")
    from rasterio.transform import Affine  # noqa: PLC0415 - may be missing

    size = {"width": 3, "height": 2, "count": 1, "dtype": "uint8", "blockxsize": 16384, "blockysize": 16384}
    at = {"crs": "EPSG:32635", "transform": Affine(2, 0, 9, 0, -2, 9)}
    file = tmp_path / "a.tif"
    with rasterio.open(file, "w", driver="GTiff", sparse_ok=True, tiled=True, **size, **at):
        pass
    refused(file, "its blocks have")


def test_a_raster_in_degrees_has_fewer_cells(tmp_path: Path) -> None:
    file = tmp_path / "a.npy"
    np.save(file, np.zeros((5001, 4000), dtype=np.uint8))
    refused(
        file, "5001 x 4000 cells, more than 20000000 that can be laid", bounds=(20, 60, 21, 61), coordinates="lonlat"
    )


@pytest.mark.parametrize(
    ("name", "text", "wrong"),
    [
        ("a.csv", "1,2\n3,x\n", "row 1, number 1 is 'x', which is no number"),
        ("a.csv", "1,2\n3\n", "row 1 has 1 numbers, the first row 2"),
        ("a.csv", "", "it is empty"),
        ("a.csv", "1,-2\n", "1 of its values are no risk, the first is -2 in row 0, column 1"),
        ("a.csv", "1,inf\n", "no risk"),
        ("a.csv", ",\n,\n", "holds no data"),
        ("a.csv.gz", "1,2\n", "cannot be read|damaged"),
        ("a.npy", "1,2\n", "damaged"),
        ("a.npz", "1,2\n", "damaged"),
        ("a.txt", "1,2\n", "no raster ends so"),
        ("a.tif", "1,2\n", "no GeoTIFF"),
        ("a.asc", "1 2 3\n", "ncols None"),
        ("a.asc", ASC + "1 2 3\n", "it has 3 values instead of 2 x 3"),
        ("a.asc", ASC + "1 2 3 4 5 6 7\n", "more than 2 x 3 values"),
        ("a.asc", ASC.replace("cellsize 10", "cellsize 0") + "1 2 3 4 5 6\n", "cellsize 0"),
        ("a.asc", ASC.replace("xllcorner 10\n", "") + "1 2 3 4 5 6\n", "no xllcorner or xllcenter"),
        ("a.asc", ASC.replace("ncols 3", "ncols 1e300"), "more than 120000000"),
        ("a.asc", ASC.replace("ncols 3", "ncols inf"), "ncols inf"),
    ],
)
def test_faults_are_told_in_one_line(name: str, text: str, wrong: str, tmp_path: Path) -> None:
    if name.endswith(".tif"):
        pytest.importorskip("rasterio")
    file = tmp_path / name
    file.write_text(text)
    refused(file, wrong, **({} if name.endswith((".asc", ".tif")) else {"bounds": BOX}))


def test_hostile_arrays_are_refused_unread(tmp_path: Path) -> None:
    file = tmp_path / "a.npy"
    np.save(file, np.array([[object()]]), allow_pickle=True)
    refused(file, "type object", bounds=BOX)
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": (10**5, 10**4)})
    file.write_bytes(head.getvalue())
    refused(file, re.escape("100000 x 10000 cells"), bounds=BOX)
    with zipfile.ZipFile(tmp_path / "b.npz", "w") as archive:
        archive.writestr("values.npy", head.getvalue())
    refused(tmp_path / "b.npz", re.escape("100000 x 10000 cells"), bounds=BOX)
    np.save(file, VALUES)
    file.write_bytes(file.read_bytes()[:-8])
    refused(file, "cut off", bounds=BOX)
    np.save(file, np.zeros(3))
    refused(file, "shape", bounds=BOX)


def test_what_is_asked_for_is_checked(tmp_path: Path) -> None:
    file = tmp_path / "a.npy"
    np.save(file, VALUES)
    refused(file, "give bounds")
    refused(file, "are empty", bounds=(0, 0, 0, 1))
    refused(file, "kind is 'people'", bounds=BOX, kind="people")
    refused(file, "no degrees", bounds=(0, 0, 10, 100), coordinates="lonlat")
    refused(file, "coordinates is 'utm'", bounds=BOX, coordinates="utm")
    refused(file, "km from the middle of the map", bounds=(0, 0, 90, 60), coordinates="lonlat")
    refused(tmp_path / "none.npy", "no such file", bounds=BOX)


@pytest.mark.parametrize("kind", ["count", "density"])
def test_cells_without_data_stay_so_in_degrees(kind: Literal["count", "density"], tmp_path: Path) -> None:
    """Pictures mark them, and they change no number."""
    values = np.arange(1.0, 31.0).reshape(5, 6)
    holes = np.where(np.indices(values.shape).sum(axis=0) < 3, np.nan, values)
    box = (24.0, 60.0, 24.6, 60.2)
    found = []
    for name, array in (("holes", holes), ("zeros", np.nan_to_num(holes))):
        np.save(tmp_path / f"{name}.npy", array)
        file = tmp_path / f"{name}.npy"
        found.append(RasterRisk.from_file(file, bounds=box, kind=kind, nodata=0.0, coordinates="lonlat"))
    assert found[0] == found[1]
    share = found[0].missing.mean()
    assert 0.0 < share <= np.isnan(holes).mean()
    assert not found[0].cells[::-1][found[0].missing].any()


@pytest.mark.parametrize("ending", [".npy", ".csv"])
def test_typed_bounds_that_look_like_degrees_are_said(ending: str, tmp_path: Path) -> None:
    file = tmp_path / f"people{ending}"
    if ending == ".npy":
        np.save(file, np.ones((20, 30)))
    else:
        np.savetxt(file, np.ones((20, 30)), delimiter=",")
    with pytest.warns(RasterWarning, match=r"taken for those of a plane; if they are degrees, give .*lonlat"):
        RasterRisk.from_file(file, bounds=(24.9, 59.9, 25.2, 60.1))
    if ending == ".npy":
        with pytest.warns(RasterWarning, match="taken for those of a plane"):
            next(open_scenarios(str(file), start=(25, 60), goal=(25.1, 60), bounds=(24.9, 59.9, 25.2, 60.1)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for bounds, coordinates in (
            ((24.9, 59.9, 25.2, 60.1), "plane"),
            ((24.9, 59.9, 25.2, 60.1), "lonlat"),
            ((0, 0, 1, 1), None),
            ((0, 0, 300, 200), None),
            ((5e5, 6e6, 6e5, 7e6), None),
        ):
            RasterRisk.from_file(file, bounds=bounds, coordinates=coordinates)  # type: ignore[arg-type]
