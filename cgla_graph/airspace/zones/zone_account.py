"""The account of zones: what became of each, in words and numbers."""

from collections import Counter
from dataclasses import dataclass
from typing import Literal, TypeAlias

State: TypeAlias = Literal["closed", "open", "left out"]


@dataclass(frozen=True)
class ZoneRecord:
    """
    What became of a zone.

    Attributes
    ----------
    file, identifier, name, kind
        Of the zone; of what is no zone in a file, `kind` is empty.
    state
        ``closed``, ``open`` or ``left out``.
    reason
        Why, in a few words.
    limits
        Floors and ceilings of its layers.
    authority
        Who may be asked.
    remark
        What else is to be known, or nothing.
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


@dataclass(frozen=True)
class ZoneAccount:
    """
    What became of every zone of some files.

    Attributes
    ----------
    records
        In the order of the files.
    remarks
        What else is to be known of the files.

    Examples
    --------
    >>> record = ZoneRecord("zones.json", "A", "", "PROHIBITED", "closed", "PROHIBITED")
    >>> ZoneAccount((record,)).summary()
    '1 zone: 1 closed (1 PROHIBITED)'
    """

    records: tuple[ZoneRecord, ...]
    remarks: tuple[str, ...] = ()

    def count(self, state: State) -> int:
        """Count those that are closed, open or left out."""
        return sum(record.state == state for record in self.records)

    def reasons(self, state: State) -> Counter[str]:
        """Count the reasons of a state."""
        return Counter(record.reason for record in self.records if record.state == state)

    def summary(self) -> str:
        """Say in one line how many are closed, open and left out, and why."""
        states: tuple[State, ...] = ("closed", "open", "left out")
        parts = []
        for state in states:
            counted = self.reasons(state)
            if counted:
                why = ", ".join(f"{count} {reason}" for reason, count in counted.most_common())
                parts.append(f"{counted.total()} {state} ({why})")
        return f"{len(self.records)} zone{'s' * (len(self.records) != 1)}: {', '.join(parts)}"

    def notes(self) -> list[str]:
        """Say what else a pilot has to know: what was taken as closed as it could not be decided, and the like."""
        found = list(self.remarks)
        counted = Counter(record.remark for record in self.records if record.remark and record.state == "closed")
        for remark, count in counted.items():
            first = next(record for record in self.records if record.remark == remark)
            more = f" and {count - 1} more" if count > 1 else ""
            found.append(f"{first.identifier}{more}: {remark}")
        return found

    def document(self) -> dict[str, object]:
        """Return all of it as JSON."""
        states: tuple[State, ...] = ("closed", "open", "left out")
        return {
            "count": len(self.records),
            **{state.replace(" ", "_"): self.count(state) for state in states},
            "notes": self.notes(),
            "list": [dict(vars(record)) for record in self.records],
        }
