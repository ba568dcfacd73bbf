"""Sharing of sightings between UAVs: radio range, delay and losses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from cgla_graph._text import shown
from cgla_graph._types import BoolArray, FloatArray, IntArray
from cgla_graph._validate import error_context, finite_number, positive_number, unmasked, whole_number, whole_tick
from cgla_graph.errors import MissionError
from cgla_graph.mission.belief import Belief, Log, Report


@dataclass(frozen=True)
class Sharing:
    """
    Radio range, delay and loss of messages between UAVs.

    On every tick, each UAV sends the reports that it has not yet sent to the others. It passes on received reports from
    the next tick on, so knowledge spreads over several hops.

    Attributes
    ----------
    is_on
        False: nothing is shared.
    radius
        Radio range, map units; None: unlimited.
    delay
        Ticks that a message takes, at least 0.
    loss
        The chance that a message is lost, in [0, 1); lost messages are sent again on the next tick.
    seed
        Seed of the losses: the same seed loses the same messages.

    Raises
    ------
    MissionError
        If a setting is out of range.

    Examples
    --------
    >>> Sharing(radius=0.3, delay=2).radius, Sharing.parse("none").is_on
    (0.3, False)
    """

    is_on: bool = True
    radius: float | None = None
    delay: int = 0
    loss: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the settings."""
        with error_context("sharing"):
            if not isinstance(self.is_on, bool):
                msg = f"is_on is {shown(self.is_on)}; give True or False"
                raise MissionError(msg)
            if self.radius is not None:
                object.__setattr__(self, "radius", positive_number("radius", self.radius))
            object.__setattr__(self, "loss", finite_number("loss", self.loss))
            whole_tick("delay", self.delay)
            whole_number("seed", self.seed, at_least=0, at_most=2**63 - 1)
            if not 0.0 <= self.loss < 1.0:
                msg = f"loss is {self.loss:g}; it must be at least 0 and below 1"
                raise MissionError(msg)

    @classmethod
    def parse(cls, value: object) -> "Sharing":
        """
        Return the `Sharing` that a user gives, as ``"none"``, ``"global"`` or itself.

        Raises
        ------
        MissionError
            If `value` is none of these.
        """
        if isinstance(value, Sharing):
            return value
        if isinstance(value, str) and value in {"none", "global"}:
            return cls(is_on=value == "global")
        msg = f'sharing is {shown(value)}; give "none", "global" or Sharing(radius=…, delay=…, loss=…, seed=…)'
        raise MissionError(msg)

    def heard(self, tick: int, positions: FloatArray) -> BoolArray:
        """
        Return which UAVs receive the messages of which others.

        Parameters
        ----------
        tick
            The tick of sending.
        positions
            Positions of all UAVs, shape ``(n, 2)``, map units.

        Returns
        -------
        heard
            Shape ``(n, n)``: ``[i, j]`` is True if `j` receives the message of `i`; False on the diagonal.

        Examples
        --------
        >>> Sharing(radius=1.0).heard(0, np.array([[0.0, 0.0], [1.0, 0.0], [2.5, 0.0]])).tolist()
        [[False, True, False], [True, False, False], [False, False, False]]
        """
        n = len(unmasked("positions", positions))
        heard = np.full((n, n), self.is_on)
        if self.radius is not None:
            apart = np.hypot(*(positions[:, None, :] - positions[None, :, :]).transpose(2, 0, 1))
            heard &= apart <= self.radius
        if self.loss > 0.0:
            # drawn from seed and tick alone, so that the same messages are lost in every run
            heard &= np.random.default_rng([self.seed, tick]).random((n, n)) >= self.loss
        np.fill_diagonal(heard, val=False)
        return heard


class Message(NamedTuple):
    """
    A message to one or more UAVs: a part of the sender's journal.

    Attributes
    ----------
    due
        The tick of arrival.
    sender, receivers
        Their numbers; the receivers rise, shape ``(r,)``.
    numbers
        The sender's journal, as in `Belief`.
    begin, end
        The part that is sent. (Who was sent a piece of it before knows that piece.)
    """

    due: int
    sender: int
    receivers: IntArray
    numbers: list[int]
    begin: int
    end: int


@dataclass
class Radio:
    """
    The messages of one mission, sent and in flight.

    Attributes
    ----------
    sharing
        The rules.
    log
        The reports of all UAVs.
    sent
        The number of reports of the sender's journal sent to the receiver, by their numbers, shape ``(n, n)``.
    under_way
        The messages in flight, in the order of sending.
    """

    sharing: Sharing
    log: Log = field(default_factory=Log)
    sent: IntArray = field(default_factory=lambda: np.zeros((0, 0), dtype=np.int64))
    under_way: list[Message] = field(default_factory=list)

    def exchange(
        self, tick: int, beliefs: Mapping[int, Belief], positions: Sequence[Any]
    ) -> list[tuple[int, int, tuple[Report, ...]]]:
        """
        Send and deliver the messages of one tick.

        Parameters
        ----------
        tick
            The current tick.
        beliefs
            Beliefs of the UAVs that take part, by their number; they are updated.
        positions
            Positions in the order of `beliefs`, map units.

        Returns
        -------
        learned
            ``(receiver, sender, reports)``: reports new to the receiver, in a fixed order.
        """
        for belief in beliefs.values():
            belief.join(self.log)
        if self.sharing.is_on and len(beliefs) > 1:
            self._send(tick, beliefs, np.asarray(positions, dtype=np.float64).reshape(-1, 2))
        due = [message for message in self.under_way if message.due <= tick]
        self.under_way = [message for message in self.under_way if message.due > tick]
        return self._deliver(due, beliefs) if due and beliefs else []

    def _send(self, tick: int, beliefs: Mapping[int, Belief], positions: FloatArray) -> None:
        """Send to every UAV within range what it was not sent yet: the beliefs from before this tick's messages."""
        numbers = np.array(list(beliefs))
        room = max(numbers.max() + 1 - len(self.sent), 0)
        self.sent = np.pad(self.sent, (0, room))
        ends = np.array([len(belief.numbers) for belief in beliefs.values()])
        begins = self.sent[np.ix_(numbers, numbers)]
        sends = self.sharing.heard(tick, positions) & (begins < ends[:, None])
        for i in np.flatnonzero(sends.any(axis=1)).tolist():
            sender, receivers = int(numbers[i]), numbers[sends[i]]
            self.sent[sender, receivers] = ends[i]
            part = int(begins[i, sends[i]].min()), int(ends[i])
            due = tick + self.sharing.delay
            self.under_way.append(Message(due, sender, receivers, beliefs[sender].numbers, *part))

    def _deliver(self, due: list[Message], beliefs: Mapping[int, Belief]) -> list[tuple[int, int, tuple[Report, ...]]]:
        """Deliver messages in turn; UAVs that have arrived hear nothing."""
        known = self.log.known
        learned: list[tuple[int, int, tuple[Report, ...]]] = []
        rows = np.full(max(len(self.sent), max(beliefs) + 1), -1)
        rows[list(beliefs)] = [belief.row for belief in beliefs.values()]
        # most messages of a swarm are known already
        common = known[rows[rows >= 0]].all(axis=0)
        for message in due:
            told = np.array(message.numbers[message.begin : message.end])
            told = told[~common[told]]
            receivers = message.receivers[rows[message.receivers] >= 0]
            where = np.ix_(rows[receivers], told)
            unknown = ~known[where]
            known[where] = True
            kept: dict[bytes, tuple[list[int], tuple[Report, ...]]] = {}
            for i in np.flatnonzero(unknown.any(axis=1)).tolist():
                # most receivers learn the same
                key = unknown[i].tobytes()
                if key not in kept:
                    new = told[unknown[i]].tolist()
                    kept[key] = new, tuple(self.log.reports[number] for number in new)
                receiver = int(receivers[i])
                beliefs[receiver].numbers += kept[key][0]
                learned.append((receiver, message.sender, kept[key][1]))
        return learned

    def can_teach(self, beliefs: Mapping[int, Belief]) -> bool:
        """Return whether a message in flight, or yet to be sent, can be new to its receiver."""
        if not self.sharing.is_on:
            return False
        known = self.log.known[[belief.row for belief in beliefs.values()]]
        return bool(self.under_way) or bool((known != known[:1]).any())

    def state(self, tick: int) -> tuple[Any, ...]:
        """Return the messages in flight, relative to a tick, without their contents."""
        return tuple((message.due - tick, message.sender, message.receivers.tobytes()) for message in self.under_way)
