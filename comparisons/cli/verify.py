"""The command `verify`: check the proof in a file, by a program that needs nothing of this library."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.options import (
    AircraftOptions,
    MapOptions,
    RasterOptions,
    ZoneOptions,
    open_map,
    option,
)

if TYPE_CHECKING:
    from cgla_graph.certificate.check_proof import Result


def verify(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="proofs that certify --write has written")],
    maps: MapOptions,
    zones: ZoneOptions,
    raster: RasterOptions,
    aircraft: AircraftOptions,
    of_map: Annotated[
        list[str] | None, option("--map MAP", "the map that the proof has to be about; options of the map change it")
    ] = None,
    as_json: Annotated[bool, option("--json", "one JSON document")] = False,
) -> None:
    """
    Check proofs: no path costs less than the bound, and the path of the file no more than its own.

    The check needs nothing but the file. Exit code 1 if one of the files does not prove what it claims.
    """
    from cgla_graph.certificate.proof_file import verify_proof
    from cgla_graph.errors import ProblemError

    problem = open_map("verify", of_map, maps, zones, raster, aircraft).problem if of_map else None
    results: list[dict[str, Any]] = []
    for file in files:
        try:
            results.append(proof_document(file, verify_proof(file, problem)))
        except ProblemError as error:
            results.append({"file": str(file), "verified": False, "fault": str(error)})
    if as_json:
        console.out_json({"proofs": results})
    else:
        for one in results:
            console.out_lines({"verified" if one["verified"] else "refused": verified_text(one)})
    if not all(one["verified"] for one in results):
        raise typer.Exit(console.MISSING)


def proof_document(file: Path, found: "Result") -> dict[str, Any]:
    """Return what a file proves as JSON; numbers that are not finite are None."""
    from cgla_graph._text import json_number

    numbers = {"lower_bound": json_number(found["lower"]), "upper_bound": json_number(found["upper"])}
    no_path = found["lower"] == float("inf")
    return {"file": str(file), "verified": True, **numbers, "no_path": no_path, "problem": found["problem"]}


def verified_text(one: dict[str, Any]) -> str:
    """Say what a file proves, or why it does not."""
    from cgla_graph._text import figure

    if not one["verified"]:
        return str(one["fault"])
    if one["no_path"]:
        return f"{one['file']}: there is no path"
    text = f"{one['file']}: no path costs less than {figure(one['lower_bound'], 9)}"
    upper = one["upper_bound"]
    if upper is None:
        return text
    return f"{text}; its path costs at most {figure(upper, 9)}: a gap of {upper / one['lower_bound'] - 1.0:.2%}"
