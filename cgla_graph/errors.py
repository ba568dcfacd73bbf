"""The errors of the toolkit: one tree, each also a builtin exception."""


class CglaError(Exception):
    """
    Base of every error that the toolkit raises on purpose.

    Examples
    --------
    >>> issubclass(ProblemError, CglaError) and issubclass(ProblemError, ValueError)
    True
    """

    def __str__(self) -> str:
        """Return the message as it is (``KeyError`` would quote it)."""
        return str(self.args[0]) if self.args else ""


class ProblemError(CglaError, ValueError):
    """A threat, a risk field, a lattice, a no-fly area or a problem is malformed."""


class GraphError(CglaError, ValueError):
    """A graph is malformed, or cannot be built as asked."""


class NodeNotFoundError(CglaError, KeyError):
    """A node is not in the graph."""


class NodeIndexError(NodeNotFoundError, IndexError):
    """No node of the graph has that index."""


class ScenarioError(CglaError, ValueError):
    """A scenario file, or a map that it names, cannot be read or is malformed."""


class FileFormatError(CglaError, ValueError):
    """A file of zones or of a plan cannot be read, is malformed or is not supported."""


class PlanError(FileFormatError):
    """A flight plan is malformed, or files of that format cannot hold it."""


class MissionError(CglaError, ValueError):
    """A mission, one of its UAVs, its world or a mission file is malformed."""


class StudyError(CglaError, ValueError):
    """A study file, or the database of a study, cannot be read, is malformed or does not fit."""


class SolverSettingError(CglaError, ValueError):
    """A solver was given a setting that it does not have, or a value that it does not allow."""


class UnknownSolverError(CglaError, KeyError):
    """No solver has that name."""


class SolverUnavailableError(CglaError, ImportError):
    """A solver needs a package that is not installed."""


class SolverFaultError(CglaError, RuntimeError):
    """A solver broke its contract: its answer is no `Solution`, or it changed its problem."""


class ProgressError(CglaError, ValueError):
    """The progress line was set to neither True nor False."""


class OutputError(CglaError, OSError):
    """A file or folder cannot be written."""


class WorkerError(CglaError, RuntimeError):
    """The processes or machines for the runs of a study do not start, or cannot be reached."""


class ClaimError(CglaError, KeyError):
    """There is no such claim, or no such counterexample."""
