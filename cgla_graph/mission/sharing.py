"""Sharing of sightings between UAVs: radio range, delay and losses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cgla_graph._text import shown
from cgla_graph._types import BoolArray, FloatArray
from cgla_graph._validate import error_context, finite_number, positive_number, unmasked, whole_number, whole_tick
from cgla_graph.errors import MissionError
from cgla_graph.mission.belief import Belief, Report


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


@dataclass
class Radio:
    """
    The messages of one mission, sent and in flight.

    Attributes
    ----------
    sharing
        The rules.
    sent
        The number of reports of the sender's journal sent to the receiver, by the pair of their numbers.
    under_way
        ``(tick of arrival, sender, receiver, reports, the same as a set)``, in the order of sending.
    """

    sharing: Sharing
    sent: dict[tuple[int, int], int] = field(default_factory=dict)
    under_way: list[tuple[int, int, int, tuple[Report, ...], frozenset[Report]]] = field(default_factory=list)

    def exchange(
        self, tick: int, beliefs: Mapping[int, Belief], positions: Sequence[Any]
    ) -> list[tuple[int, int, list[Report]]]:
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
        if self.sharing.is_on and len(beliefs) > 1:
            numbers = list(beliefs)
            heard = self.sharing.heard(tick, np.asarray(positions, dtype=np.float64).reshape(-1, 2))
            # every UAV sends its belief from before this tick's messages
            journals = {number: len(belief.journal) for number, belief in beliefs.items()}
            messages: dict[tuple[int, int], tuple[tuple[Report, ...], frozenset[Report]]] = {}
            for i, j in np.argwhere(heard).tolist():
                sender, receiver = numbers[i], numbers[j]
                begin, end = self.sent.get((sender, receiver), 0), journals[sender]
                if end > begin:
                    self.sent[sender, receiver] = end
                    if (sender, begin) not in messages:
                        reports = tuple(beliefs[sender].journal[begin:end])
                        messages[sender, begin] = reports, frozenset(reports)
                    self.under_way.append((tick + self.sharing.delay, sender, receiver, *messages[sender, begin]))
        learned = []
        due = [message for message in self.under_way if message[0] <= tick]
        self.under_way = [message for message in self.under_way if message[0] > tick]
        for _, sender, receiver, reports, each in due:
            # UAVs that have arrived hear nothing; most messages of a swarm are known already
            if receiver in beliefs and not each <= beliefs[receiver].known:
                learned.append((receiver, sender, beliefs[receiver].hear(reports)))
        return learned

    def can_teach(self, beliefs: Mapping[int, Belief]) -> bool:
        """Return whether a message in flight, or yet to be sent, can be new to its receiver."""
        if not self.sharing.is_on:
            return False
        known = [belief.known for belief in beliefs.values()]
        return bool(self.under_way) or any(one != known[0] for one in known)
