"""Proof files of commands: checked before the work, and written after it by `cgla_graph.save_proof`."""

import json
import math
import os
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cgla_graph._text import at_most, figure, floored, json_number, place, rounded_down
from cgla_graph.certificate.proof_target import ON_EARTH, proof_target, require_provable
from cgla_graph.comparisons import files
from cgla_graph.errors import CglaError, ProblemError
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField
from cgla_graph.model.solution import Status
from cgla_graph.scenarios.scenario import Scenario

if TYPE_CHECKING:
    from cgla_graph.airspace.plan_check.result import PlanCheck
    from cgla_graph.certificate.proof_file import Proven
    from cgla_graph.comparisons.study.runner import Run
    from cgla_graph.comparisons.study.study import Study
    from cgla_graph.scenarios.graphs.graph_scenario import AnyScenario


#: The file of a study's folder that says where the proofs of its brackets are.
INDEX = "proofs.json"


@dataclass(frozen=True)
class ProofLine:
    """
    What a proof file proves, or why there is none.

    Attributes
    ----------
    file
        The file.
    found
        What it proves; None if nothing.
    fault
        Why it proves nothing.
    bound
        The bound of the command itself; NaN where there is none.
    """

    file: Path
    found: "Proven | None" = None
    fault: str = ""
    bound: float = math.nan

    def document(self) -> dict[str, Any]:
        """Return it as JSON; numbers that are not finite are None."""
        if self.found is None:
            return {"file": str(self.file), "verified": False, "fault": self.fault or None}
        lower, upper = self.found["lower"], self.found["upper"]
        return {
            "file": str(self.file),
            "verified": True,
            "lower_bound": json_number(lower),
            "upper_bound": json_number(upper),
            "no_path": lower == math.inf,
            "problem": self.found["problem"],
            "note": self.found["note"],
        }

    def lines(self) -> dict[str, str]:
        """Return the line to print."""
        return {"in file": self.text()}

    @property
    def files(self) -> list[Path]:
        """The file, if it was written."""
        return [] if self.found is None else [self.file]

    def text(self) -> str:
        """Say it in one line."""
        if self.found is None:
            return self.fault
        lower, upper, note = self.found["lower"], self.found["upper"], self.found["note"]
        unit = " m" if ON_EARTH in note else ""
        said = [f"{self.file}: there is no path"]
        if lower < math.inf:
            said = [f"{self.file}: no path costs less than {rounded_down(lower, 9)}{unit}"]
        if lower < upper < math.inf:
            more = "" if lower <= 0.0 else f", at most {at_most(upper / lower - 1.0)} more"
            said.append(f"its path costs at most {figure(-floored(-upper, 9), 9)}{unit}{more}")
        if math.isfinite(self.bound):
            said.append(f"the bound without a file: {rounded_down(self.bound, 9)}{unit}")
        return "; ".join([*said, *filter(None, [note])])


def read_proof(option: str, file: Path | None, refused: Mapping[str, tuple[object, str]]) -> Path | None:
    """
    Check the file of a proof, and that its command finds a path that a proof file can hold, before any work.

    Parameters
    ----------
    option
        The option that names the file.
    file
        The file; None if none is wanted.
    refused
        Options that exclude a proof file: whether each is given, and why.

    Raises
    ------
    CglaError
        If one of them is given, or the file cannot be written.
    """
    if file is None:
        return None
    for other, (given, why) in refused.items():
        if given:
            msg = f"{option} {file}: {why}; leave out {other} or {option}"
            raise CglaError(msg)
    files.make_folder(file.parent)
    return proof_target(file, option)


def check_provable(
    option: str, file: Path | None, field: RiskField, start: Sequence[float], goal: Sequence[float]
) -> None:
    """
    Refuse the file of a proof that cannot be, before any work.

    Raises
    ------
    CglaError
        If there is no proof for paths between these ends over this field.
    """
    if file is None:
        return
    try:
        require_provable(field, start, goal)
    except CglaError as error:
        msg = f"{option} {file}: {error}, or leave {option} out"
        raise CglaError(msg) from error


def proof_of_run(file: Path, run: "Run", tolerance: float) -> ProofLine:
    """
    Write the proof of a run, with its path; without one, a proof that there is none, if that is proven.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    from cgla_graph.certificate.proof_file import save_proof  # noqa: PLC0415 - slow to import, and few runs are saved

    solution, certificate = run.solution, run.certificate
    has_path, problem = solution.status.has_path, run.on_map.problem
    settings = {} if certificate is None else certificate.proof_settings
    bound = math.nan if certificate is None else certificate.lower_bound
    if not has_path and bound != math.inf and solution.status is not Status.NO_PATH:
        return ProofLine(file, fault=f"{file}: not written: no path was found, and maybe there is one")
    path = solution.path if has_path else None
    return written(file, bound, lambda: save_proof(problem, file, path, **(settings | {"tolerance": tolerance})))


def targets_of(study: "Study", folder: Path) -> dict[str, Path]:
    """
    Name the proof files of a study, one for each map, before any work.

    Raises
    ------
    CglaError
        If the study has no bounds, a scenario has no proof file, or one cannot be written.
    """
    if study.tolerance is None:
        msg = f"--proofs {folder}: without bounds, there is no proof to write; leave out --no-certificate or --proofs"
        raise CglaError(msg)
    others = [one.name for one in (*study.missions, *study.scenarios) if not isinstance(one, Scenario)]
    if others:
        msg = f"--proofs {folder}: only maps have proof files, and {others[0]} is none; compare it without --proofs"
        raise CglaError(msg)
    taken: set[str] = set()
    found = {one.name: folder / f"{files.file_stem(one.name, taken)}.proof" for one in study.scenarios}
    files.make_folder(folder)
    for one in study.scenarios:
        problem = one.problem
        proof_target(found[one.name], "--proofs")
        if isinstance(problem, Problem):
            check_provable("--proofs", found[one.name], problem.field, problem.start, problem.goal)
    return found


def proofs_of_runs(
    groups: Sequence[Sequence["Run"]], targets: Mapping[str, Path], tolerance: float, home: Path | None
) -> list[ProofLine]:
    """
    Write the proof of each scenario, with the best path of its runs, and an index for the report.

    Parameters
    ----------
    groups
        The runs, a group a scenario.
    targets
        The files, by the names of the scenarios.
    tolerance
        That of the bounds.
    home
        The folder of the study; None without one.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    lines, index = [], {}
    for runs in groups:
        best = min(runs, key=lambda run: run.solution.cost if run.solution.status.has_path else math.inf)
        file = targets[best.scenario.name]
        lines.append(proof_of_run(file, best, tolerance))
        if home is not None and lines[-1].found is not None:
            index[best.scenario.name] = {**lines[-1].document(), "file": _seen_from(home, file)}
    if home is not None:
        files.write_text(home / INDEX, json.dumps(index, ensure_ascii=False, allow_nan=False, indent=1) + "\n")
    return lines


def _seen_from(home: Path, file: Path) -> str:
    """Return the path of a file as a link in a page of a folder."""
    try:
        return Path(os.path.relpath(file, home)).as_posix()
    except ValueError:
        # another drive
        return file.absolute().as_posix()


def linked_proofs(home: Path, scenarios: Sequence["AnyScenario"]) -> dict[str, dict[str, Any]]:
    """
    Return the proofs of a study's brackets that are where its index says, and about its maps, by scenario.

    Parameters
    ----------
    home
        The folder of the study.
    scenarios
        Its scenarios.

    Returns
    -------
    proofs
        ``href``: the path from the folder; ``command``: what checks the file; ``lower_bound``: None if no path exists.
    """
    try:
        index = json.loads((home / INDEX).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    from cgla_graph.certificate.proof_file import problem_digest  # noqa: PLC0415 - as above, and few studies have proofs

    found = {}
    for one in scenarios:
        entry = index.get(one.name) if isinstance(index, dict) else None
        if not isinstance(entry, dict) or not isinstance(one.problem, Problem):
            continue
        file, bound = entry.get("file"), entry.get("lower_bound")
        if isinstance(file, str) and entry.get("problem") == problem_digest(one.problem) and (home / file).is_file():
            bound = float(bound) if isinstance(bound, int | float) else None
            command = shlex.join(["cgla", "verify", os.path.normpath(home / file)])
            found[one.name] = {"href": file, "command": command, "lower_bound": bound}
    return found


def proof_of_check(file: Path, checked: "PlanCheck") -> ProofLine:
    """
    Write the proof of the bracket of a plan that was checked.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    bound = math.nan if checked.best is None else checked.best.lower_bound
    return written(file, bound, lambda: checked.save_proof(file))


def written(file: Path, bound: float, save: Callable[[], "Proven"]) -> ProofLine:
    """
    Say what a file proves that is written here; if it cannot be, why.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    try:
        return ProofLine(file, save(), bound=bound)
    except ProblemError as error:
        return ProofLine(file, fault=f"{place(file)}: not written: {error}")
