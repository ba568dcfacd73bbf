"""What stands beside a raster counts: GDAL's ``.aux.xml``, ``.prj`` and world files; a contradiction is an error."""

from pathlib import Path

import numpy as np
import pyproj
import pytest
from raster_files import ASC, VALUES, geotiff, refused

from cgla_graph.errors import ProblemError
from cgla_graph.model.rasters.reading import read_place
from cgla_graph.model.risk_raster import RasterRisk

UTM, DEGREES = pyproj.CRS("EPSG:32635").to_wkt("WKT1_ESRI"), pyproj.CRS("EPSG:4326").to_wkt("WKT1_ESRI")


def with_aux(file: Path, text: str) -> Path:
    file.with_name(f"{file.name}.aux.xml").write_text(f"<PAMDataset>{text}</PAMDataset>")
    return file


def band(text: str) -> str:
    return f'<PAMRasterBand band="1">{text}</PAMRasterBand>'


def test_nodata_scale_and_offset_of_an_aux_file_count(tmp_path: Path) -> None:
    """As GDAL reads them, which the library keeps from reading files beside a raster by itself."""
    rasterio = pytest.importorskip("rasterio")
    values = np.array([[7, 65535, 3], [4, 5, 65535]], dtype=np.uint16)
    file = geotiff(tmp_path / "a.tif", values, 4e5, 6.65e6, 100.0, "EPSG:32635")
    assert RasterRisk.from_file(file).greatest == 65535.0
    with_aux(file, band("<NoDataValue>65535</NoDataValue><Scale>0.5</Scale><Offset>1</Offset>"))
    refused(file, "2 of its cells have no data")
    raster = RasterRisk.from_file(file, nodata=0.0)
    with rasterio.open(file) as opened:
        expected = opened.read(1, masked=True) * opened.scales[0] + opened.offsets[0]
    assert raster.values == pytest.approx(np.ma.filled(expected.astype(float), np.nan), nan_ok=True)
    # a band that is not the first, and statistics, say nothing
    with_aux(file, '<Metadata/><PAMRasterBand band="2"><NoDataValue>7</NoDataValue></PAMRasterBand>')
    assert RasterRisk.from_file(file).greatest == 65535.0


@pytest.mark.parametrize("kind", ["float32", "uint8", "float64"])
def test_what_an_aux_file_repeats_is_no_contradiction(kind: str, tmp_path: Path) -> None:
    pytest.importorskip("rasterio")
    least = float(np.finfo(np.float32).min) if kind == "float32" else 255.0 if kind == "uint8" else float("nan")
    values = np.array([[7, least, 3], [4, 5, 6]], dtype=kind)
    file = geotiff(tmp_path / "a.tif", values, 4e5, 6.65e6, 100.0, "EPSG:32635", nodata=least)
    text = "-3.40282347e+38" if kind == "float32" else "255" if kind == "uint8" else "nan"
    place = "<GeoTransform> 4.0e+05, 1.0e+02, 0, 6.65e+06, 0, -1.0e+02</GeoTransform>"
    with_aux(file, f"<SRS>{UTM}</SRS>{place}{band(f'<NoDataValue>{text}</NoDataValue>')}")
    assert RasterRisk.from_file(file, nodata=0.0).missing.sum() == 1
    bare = geotiff(tmp_path / "b.tif", values.astype(kind), 4e5, 6.65e6, 100.0, "EPSG:32635")
    with_aux(bare, band(f"<NoDataValue>{text}</NoDataValue>"))
    assert RasterRisk.from_file(bare, nodata=0.0).missing.sum() == 1


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        (band("<NoDataValue>9</NoDataValue>"), r"nodata 9\.0, the raster itself 3\.0; remove the wrong one"),
        (f"<SRS>{pyproj.CRS('EPSG:32636').to_wkt()}</SRS>", "it says SRS .*32636.*remove"),
        ("<GeoTransform>0, 100, 0, 0, 0, -100</GeoTransform>", "it places the raster at"),
        ("<GeoTransform>0, 100</GeoTransform>", "GeoTransform has 2 numbers instead of 6"),
        (band("<Scale>1e999</Scale>"), "Scale: .*1e999"),
        ("<GCPList/>", "points of control"),
        ("</PAMDataset><PAMDataset>", "not XML"),
    ],
)
def test_contradictions_are_refused(text: str, wrong: str, tmp_path: Path) -> None:
    pytest.importorskip("rasterio")
    file = geotiff(tmp_path / "a.tif", VALUES, 4e5, 6.65e6, 100.0, "EPSG:32635", nodata=3.0)
    with pytest.raises(ProblemError, match=rf"a\.tif\.aux\.xml: .*{wrong}"):
        RasterRisk.from_file(with_aux(file, text), nodata=0.0)


def test_an_aux_file_is_untrusted(tmp_path: Path) -> None:
    pytest.importorskip("rasterio")
    file = geotiff(tmp_path / "a.tif", VALUES, 4e5, 6.65e6, 100.0, "EPSG:32635")
    aux = file.with_name("a.tif.aux.xml")
    aux.write_text('<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><PAMDataset>&b;</PAMDataset>')
    with pytest.raises(ProblemError, match="document type or entities"):
        RasterRisk.from_file(file)
    geotiff(tmp_path / "a.tif", VALUES, 4e5, 6.65e6, 100.0, None)
    aux.write_text("<PAMDataset><SRS>" + "PROJCS[" * 40_000 + "</SRS></PAMDataset>")
    with pytest.raises(ProblemError, match="names no coordinate reference system"):
        RasterRisk.from_file(file)
    aux.write_text("<other/>")
    with pytest.raises(ProblemError, match="not PAMDataset"):
        RasterRisk.from_file(file)


@pytest.mark.parametrize("ending", [".asc", ".tif"])
def test_a_prj_says_the_coordinates(ending: str, tmp_path: Path) -> None:
    """Also that of an ``.aux.xml``."""
    if ending == ".tif":
        pytest.importorskip("rasterio")
        file = geotiff(tmp_path / "a.tif", VALUES, 24.0, 60.02, 0.01, None)
    else:
        file = tmp_path / "a.asc"
        text = ASC.replace("corner 10", "corner 24").replace("corner 20", "corner 60").replace("size 10", "size 0.01")
        file.write_text(text + "\n".join(" ".join(map(str, row)) for row in VALUES.tolist()))
    refused(file, r"nothing says in which coordinates it is, .* look like degrees; .*--coordinates lonlat")
    expected = RasterRisk.from_file(file, coordinates="lonlat")
    assert RasterRisk.from_file(file, coordinates="plane").bounds == pytest.approx((24.0, 60.0, 24.03, 60.02))
    (tmp_path / "a.prj").write_text(DEGREES)
    assert RasterRisk.from_file(file) == expected
    refused(file, 'set coordinates = "lonlat"', coordinates="plane")
    (tmp_path / "a.prj").write_text(UTM)
    assert read_place(file).system is not None
    (tmp_path / "a.prj").write_text("Projection    UTM\nZone   35\n")
    refused(file, "names no coordinate reference system")
    (tmp_path / "a.prj").unlink()
    assert RasterRisk.from_file(with_aux(file, f"<SRS>{DEGREES}</SRS>")) == expected


def test_toy_grids_and_cells_of_metres_are_planes(tmp_path: Path) -> None:
    file = tmp_path / "a.asc"
    file.write_text(ASC + "1 2 3 4 5 6\n")
    assert RasterRisk.from_file(file).bounds == (10.0, 20.0, 40.0, 40.0)


@pytest.mark.filterwarnings("ignore:Dataset has no geotransform")
def test_world_files(tmp_path: Path) -> None:
    """They place a GeoTIFF that has no place of its own, and may not contradict one that has."""
    pytest.importorskip("rasterio")
    world = tmp_path / "a.tfw"
    file = geotiff(tmp_path / "a.tif", VALUES, 4e5, 6.65e6, 100.0, "EPSG:32635")
    world.write_text("100\n0\n0\n-100\n400050\n6649950\n")
    assert RasterRisk.from_file(file).bounds == (4e5, 6.65e6 - 200.0, 4e5 + 300.0, 6.65e6)
    world.write_text("100\n0\n0\n-100\n400000\n6650000\n")
    with pytest.raises(ProblemError, match=r"a\.tfw: it places the raster at \(399950.*the raster itself at \(400000"):
        RasterRisk.from_file(file)
    world.write_text("100\n0\n0\nx\n")
    with pytest.raises(ProblemError, match=r"a\.tfw: .*'x'"):
        RasterRisk.from_file(file)
    world.write_text("100\n0\n0\n-100\n400050\n6649950\n")
    geotiff(file, VALUES, 0.0, 0.0, 1.0, "EPSG:32635", transform=None)
    assert RasterRisk.from_file(file).bounds == (4e5, 6.65e6 - 200.0, 4e5 + 300.0, 6.65e6)
