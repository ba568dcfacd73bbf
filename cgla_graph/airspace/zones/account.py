"""Account of all zones of some files: the state of each, with the reason."""

from collections import Counter
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

from cgla_graph.airspace.zones.zone import label_of

State: TypeAlias = Literal["closed", "open", "left out"]
STATES: tuple[State, ...] = get_args(State)


@dataclass(frozen=True)
class ZoneRecord:
    """
    State of a zone, with the reason.

    Attributes
    ----------
    file, identifier, name, kind
        Data of the zone; `kind` is in the words of the file, and empty for a point or line.
    state
        ``closed``, ``open`` or ``left out``.
    reason
        Reason for the state, in a few words.
    limits
        Floors and ceilings of its layers.
    authority
        Contact of the authority.
    remark
        Remark for pilots, may be empty.
    """

    file: str
    identifier: str
    name: str
    kind: str
    state: State
    reason: str
    limits: str = ""
    authority: str = ""
    remark: str = ""

    @property
    def label(self) -> str:
        """Its identifier, and its name if it differs."""
        return label_of(self.identifier, self.name)


@dataclass(frozen=True)
class ZoneAccount:
    """
    States of all zones of some files.

    Attributes
    ----------
    records
        One record per zone, in the order of the files.
    remarks
        Remarks on the files.
    altitude
        Altitude at which zones count, metres and reference; empty for all heights.
    vertical_clearance
        Metres by which floors and ceilings are widened.

    Examples
    --------
    >>> record = ZoneRecord("zones.json", "A", "", "PROHIBITED", "closed", "PROHIBITED")
    >>> ZoneAccount((record,), altitude="80 m AGL").summary()
    '1 zone: 1 closed (1 PROHIBITED)'
    """

    records: tuple[ZoneRecord, ...]
    remarks: tuple[str, ...] = ()
    altitude: str = ""
    vertical_clearance: float = 0.0

    def count(self, state: State) -> int:
        """Count the zones in a state."""
        return sum(record.state == state for record in self.records)

    def reasons(self, state: State) -> Counter[str]:
        """Count the reasons of a state."""
        return Counter(record.reason for record in self.records if record.state == state)

    def summary(self) -> str:
        """Return the number of zones in each state and the reasons, in one line."""
        parts = []
        for state in STATES:
            counted = self.reasons(state)
            if counted:
                why = ", ".join(f"{count} {reason}" for reason, count in counted.most_common())
                parts.append(f"{counted.total()} {state} ({why})")
        return f"{len(self.records)} zone{'s' * (len(self.records) != 1)}: {', '.join(parts)}"

    @property
    def rule(self) -> str:
        """Where zones count, and from what a clearance is measured."""
        if not self.altitude:
            return "horizontal, from zones closed at any height"
        return (
            f"horizontal, from zones closed at {self.altitude}, and from the ground up to it at take-off and landing; "
            f"vertical clearance {self.vertical_clearance:g} m"
        )

    def notes(self) -> list[str]:
        """Return remarks for pilots, for example which zones are closed because heights could not be compared."""
        found = list(self.remarks)
        counted = Counter(record.remark for record in self.records if record.remark and record.state == "closed")
        for remark, count in counted.items():
            first = next(record for record in self.records if record.remark == remark)
            more = f" and {count - 1} more" if count > 1 else ""
            found.append(f"{first.identifier}{more}: {remark}")
        return found

    def document(self) -> dict[str, object]:
        """Return the account as JSON."""
        return {
            "count": len(self.records),
            **{state.replace(" ", "_"): self.count(state) for state in STATES},
            "altitude": self.altitude or None,
            "vertical_clearance": self.vertical_clearance,
            "rule": self.rule,
            "notes": self.notes(),
            "list": [dict(vars(record)) for record in self.records],
        }
