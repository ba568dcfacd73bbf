"""The command `verify`: check the proof in a file, by a program that needs nothing of this library."""

from pathlib import Path
from typing import Annotated

import typer

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.options import (
    AircraftOptions,
    GroundRiskOptions,
    MapOptions,
    RasterOptions,
    ZoneOptions,
    map_changes,
    open_map,
    option,
)

#: Numbers that are computed for a file, at most: some minutes (`check_proof.MOST_WORK`, which is imported late).
MOST_WORK = 1e10


def verify(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE...", help="proofs that --write or --proof of a command has written")
    ],
    maps: MapOptions,
    zones: ZoneOptions,
    raster: RasterOptions,
    aircraft: AircraftOptions,
    ground: GroundRiskOptions,
    of_map: Annotated[
        list[str] | None, option("--map MAP", "the map that the proof has to be about; options of the map change it")
    ] = None,
    most_work: Annotated[
        float, option("--most-work N", "refuse files that ask for more numbers to be computed")
    ] = MOST_WORK,
    as_json: Annotated[bool, option("--json", "one JSON document")] = False,
) -> None:
    """
    Check proofs: no path costs less than the bound, and the path of the file no more than its own.

    The check needs nothing but the file. Exit code 1 if one of the files does not prove what it claims.
    """
    from cgla_graph.certificate.proof_file import verify_proof
    from cgla_graph.comparisons.cli import ground as on_ground
    from cgla_graph.comparisons.study.proofs import ProofLine
    from cgla_graph.errors import CglaError, ProblemError

    asked = [f"--{name.replace('_', '-')}" for name, value in vars(ground).items() if value is not None]
    changes = [*map_changes(maps, zones, raster, aircraft).given, *asked]
    changes += ["--zones-list"] if zones.zones_list else []
    if changes and not of_map:
        msg = f"{changes[0]} is about a map; give it (--map MAP)"
        raise CglaError(msg)
    problem = None
    if of_map:
        k = on_ground.price_of_risk(maps.k, ground)
        _, opened = on_ground.asked_of(open_map("verify", of_map, maps, zones, raster, aircraft, k=k), ground)
        problem = opened.problem
        if zones.zones_list is not None:
            zones.report([opened], as_json=True)
    results: list[ProofLine] = []
    for file in files:
        try:
            results.append(ProofLine(file, verify_proof(file, problem, most_work=most_work)))
        except ProblemError as error:
            results.append(ProofLine(file, fault=str(error)))
        if not as_json:
            console.out_lines({"verified" if results[-1].found else "refused": results[-1].text()})
    if as_json:
        console.out_json({"proofs": [one.document() for one in results]})
    if not all(one.found for one in results):
        raise typer.Exit(console.MISSING)
