"""Raster files for tests, and checks of what is read from them."""

from pathlib import Path

import numpy as np
import pyproj
import pytest

from cgla_graph.errors import ProblemError
from cgla_graph.model.risk_raster import RasterRisk

VALUES = np.array([[0.0, 1.5, 2.0], [3.0, 0.25, 7.0]])
BOX = (10.0, 20.0, 40.0, 40.0)
ASC = "ncols 3\nnrows 2\nxllcorner 10\nyllcorner 20\ncellsize 10\nNODATA_value -9\n"


def total(raster: RasterRisk) -> float:
    width, height = raster.cell_size
    return float(raster.cells.sum()) * width * height


def geotiff(
    path: Path, values: np.ndarray, west: float, north: float, size: float, crs: str | None, **more: object
) -> Path:
    rasterio = pytest.importorskip("rasterio")
    from rasterio.transform import Affine  # noqa: PLC0415 - needs rasterio

    place = more.pop("transform", Affine(size, 0.0, west, 0.0, -size, north))
    bands = values if values.ndim == 3 else values[None]
    shape = {"count": bands.shape[0], "height": bands.shape[1], "width": bands.shape[2], "dtype": str(values.dtype)}
    with rasterio.open(path, "w", driver="GTiff", crs=crs, transform=place, **shape, **more) as file:
        file.write(bands)
    return path


def refused(path: Path, wrong: str, **how: object) -> None:
    with pytest.raises(ProblemError, match=wrong) as caught:
        RasterRisk.from_file(path, **how)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def smooth(n: int) -> np.ndarray:
    """People that change slowly from cell to cell."""
    x, y = np.meshgrid(np.linspace(0.0, 1.0, n), np.linspace(0.0, 1.0, n))
    return 5.0 + np.sin(5.0 * x + 2.0 * y) + np.cos(4.0 * y)


def laid_at(path: Path, crs: str, lon: float, lat: float, half: float = 8e3, n: int = 24) -> tuple[Path, np.ndarray]:
    """Write a raster around a place, and return the middles of its cells, degrees, row by row."""
    system, there = pyproj.CRS(crs), pyproj.Transformer.from_crs("EPSG:4326", crs, always_xy=True)
    unit = system.axis_info[0].unit_conversion_factor if system.is_projected else 111e3
    x, y = there.transform(lon, lat)
    size = 2.0 * half / unit / n
    west, north = x - half / unit, y + half / unit
    geotiff(path, smooth(n), west, north, size, crs)
    grid = np.meshgrid(west + size * (np.arange(n) + 0.5), north - size * (np.arange(n) + 0.5))
    return path, np.column_stack(there.transform(*(one.ravel() for one in grid), direction="INVERSE"))
