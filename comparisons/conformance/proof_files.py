"""
Proof files of the suite: some are stored, others are written again; `cgla conform verify` checks them.

Run ``make conformance``, or ``python -m cgla_graph.comparisons.conformance.proof_files FOLDER``, to write all of them,
and what is known of them, into the folder of this module. It takes minutes.
"""

import json
import math
import sys
from collections.abc import Iterator, Sequence
from functools import cache, partial
from importlib import resources
from pathlib import Path
from tempfile import TemporaryDirectory

from cgla_graph._text import place
from cgla_graph.certificate.proof_file import Proven, save_proof, verify_proof
from cgla_graph.comparisons import console, files
from cgla_graph.comparisons.conformance.documents import Document
from cgla_graph.comparisons.conformance.suite import WIDEST, Instance, chosen
from cgla_graph.comparisons.study.proofs import ProofLine, written
from cgla_graph.errors import OutputError, ProblemError

#: The file in this package, the folder of stored proofs, and their bytes, at most: of one, and of all.
FILE, FOLDER, MOST_BYTES, MOST_IN_ALL = "proofs.json", "proofs", 110_000, 700_000
#: Gaps of mazes: closer proofs of them take hours.
OF_MAZES = 0.05


class ProofRecord(Document):
    """
    What is known of the proof file of an instance.

    Examples
    --------
    >>> records()["open-straight"].is_stored
    True
    """

    name: str
    tolerance: float
    lower_bound: float | None
    bytes: int
    problem: str
    is_stored: bool


class ProofRecords(Document):
    """Records of all instances that have a proof file."""

    proofs: list[ProofRecord]


@cache
def records() -> dict[str, ProofRecord]:
    """Read the records of proof files, by the names of their instances."""
    text = resources.files(__package__).joinpath(FILE).read_text(encoding="utf-8")
    return {one.name: one for one in ProofRecords.model_validate_json(text).proofs}


def tolerance_of(instance: Instance) -> float:
    """Return the gap that the proof file of an instance is made for."""
    return OF_MAZES if instance.family == "maze" else WIDEST


def prove_suite(instances: Sequence[Instance], folder: Path) -> Iterator[ProofLine]:
    """
    Write the proof files of instances, ``NAME.proof``.

    Parameters
    ----------
    instances
        The instances.
    folder
        Where to; it is made.

    Yields
    ------
    proof
        What each file proves, or why it was not written.

    Raises
    ------
    OutputError
        If the folder or a file cannot be written.
    """
    files.make_folder(folder)
    for one in instances:
        file, bound = folder / f"{one.name}.proof", math.nan if one.lower_bound is None else one.lower_bound
        yield written(file, bound, partial(_saved, one, file))


def _saved(instance: Instance, file: Path) -> Proven:
    return save_proof(instance.problem.build(), file, instance.path, tolerance=tolerance_of(instance))


def verify_suite(instances: Sequence[Instance] = (), folder: Path | None = None) -> Iterator[ProofLine]:
    """
    Check the proof files of instances: each has to prove a bound of its problem, and of its path.

    Parameters
    ----------
    instances
        The instances; by default all.
    folder
        Holds more files, ``NAME.proof``, as `prove_suite` writes them; None for those that are stored here.

    Yields
    ------
    proof
        What each file proves; or why it is refused; or, without a `fault`, that there is no file.

    Raises
    ------
    OutputError
        If there is no such folder.

    Examples
    --------
    >>> (one,) = verify_suite(chosen(["infeasible-wall"]))
    >>> one.text()
    'infeasible-wall: there is no path'
    """
    if folder is not None and not folder.is_dir():
        msg = f"{place(folder)}: there is no such folder; cgla conform prove FOLDER writes one"
        raise OutputError(msg)
    for one in instances or chosen():
        given = None if folder is None else folder / f"{one.name}.proof"
        if given is not None and given.exists():
            yield _verified(one, given)
            continue
        stored = resources.files(__package__).joinpath(FOLDER, f"{one.name}.proof")
        if not stored.is_file():
            yield ProofLine(Path(one.name))
            continue
        with resources.as_file(stored) as file:
            yield _verified(one, file)


def _verified(instance: Instance, file: Path) -> ProofLine:
    """Check one file: its problem is that of the instance, and its bounds do not contradict the suite's."""
    name = Path(instance.name)
    try:
        found = verify_proof(file, instance.problem.build())
    except ProblemError as error:
        return ProofLine(name, fault=f"{name}: {error}")
    lower, upper = (math.inf if one is None else one for one in (instance.lower_bound, instance.upper_bound))
    # (the suite's own numbers are rounded)
    if found["lower"] > upper * (1.0 + 1e-9) or found["upper"] < lower * (1.0 - 1e-9):
        return ProofLine(name, fault=f"{name}: the proof is true, and contradicts the bounds of the suite; report it")
    return ProofLine(name, found, bound=math.nan if instance.lower_bound is None else lower)


def without_file(name: str) -> str:
    """
    Say how the proof of an instance is written that has no file here.

    Examples
    --------
    >>> without_file("maze-large").split(" (")[0]
    'maze-large: cgla conform prove FOLDER --instances maze-large writes it'
    """
    known = records().get(name)
    if known is None:
        return f"{name}: there is no proof in a file"
    of_file = f"about {known.bytes / 1e6:.1f} MB, about the problem {known.problem[:16]}"
    return f"{name}: cgla conform prove FOLDER --instances {name} writes it ({of_file})"


def main() -> None:
    """Write all proof files, store small ones in the folder that is given, and write the records there."""
    home, found, total = Path(sys.argv[1]), list[tuple[ProofRecord, bytes]](), 0
    stored = files.make_folder(home / FOLDER)
    for old in stored.glob("*.proof"):
        old.unlink()
    with TemporaryDirectory() as folder:
        for one, proof in zip(chosen(), prove_suite(chosen(), Path(folder)), strict=True):
            console.say(proof.text())
            if proof.found is None:
                continue
            data, lower = proof.file.read_bytes(), proof.found["lower"]
            record = ProofRecord(
                name=one.name,
                tolerance=tolerance_of(one),
                lower_bound=lower if math.isfinite(lower) else None,
                bytes=len(data),
                problem=proof.found["problem"],
                is_stored=False,
            )
            found.append((record, data))
    # (the smallest ones first)
    for record, data in sorted(found, key=lambda one: one[0].bytes):
        total += record.bytes
        record.is_stored = record.bytes <= MOST_BYTES and total <= MOST_IN_ALL
        if record.is_stored:
            files.write_bytes(stored / f"{record.name}.proof", data)
    made = [record for record, _ in found]
    lines = ",\n".join(json.dumps(one.model_dump(mode="json"), separators=(",", ":")) for one in made)
    files.write_text(home / FILE, f'{{"proofs":[\n{lines}\n]}}\n')


if __name__ == "__main__":
    main()
