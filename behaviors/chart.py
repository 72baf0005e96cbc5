"""The statechart of a mission.

Three regions run side by side. *mission* is the thesis's client: search, arrive, select, then wait or move_to, and so
on to the next target. *equipment* and *safety* watch over it: an outage suspends the mission from any state, a trip
ends it from any state, without an arrow from each.

The rules of this file: every transition stands here and carries guards, not code; events are facts
(`behaviors.events`); what is done in a state stands in `behaviors.skills`; what is chosen stands in
`behaviors.recovery`; nothing here knows time. The motors never wait for the chart: safety stops them first and reports
the fact afterwards.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from statemachine import HistoryState, State, StateChart

from behaviors.events import Event, Fact
from behaviors.recovery import Choice, Recovery
from behaviors.target_queue import TargetOutcome, TargetQueue

Decide = Callable[[], Choice]


class MissionChart(StateChart[Any]):
    """A mission from start to finish.

    Args:
        queue: The targets; guards ask it whether more are left.
        decide: Called on entry of `select`; its choice leads on.
        listeners: Objects with ``after_transition(event, source, target, ...)``, for journals and displays.
    """

    # an exception in a callback must surface at the executive, which stops the motors; as an event it would vanish
    catch_errors_as_events = False

    class robot(State.Parallel):  # noqa: N801 - states are named as events are
        """The three regions."""

        class mission(State.Compound):  # noqa: N801
            """What the robot is after."""

            idle = State(initial=True)

            class active(State.Compound):  # noqa: N801
                """Pursuing a target."""

                search = State(initial=True)
                arrive = State()
                select = State()

                class recover(State.Compound):  # noqa: N801
                    """Giving the next search a better chance."""

                    wait = State(initial=True)
                    move_to = State()
                    detour = State()
                    rescan = State()

                reached = State()
                gave_up = State()
                resume_here = HistoryState(type="deep")

                target_seen = search.to(arrive) | recover.to(arrive)
                search_failed = search.to(select)
                # not internal: 3.2.2 enters the initial states of all regions on an internal self-transition
                continued = arrive.to(arrive)
                arrived = arrive.to(reached)
                arrive_failed = arrive.to(select)

                select.to(recover.wait, cond="chose_wait")
                select.to(recover.move_to, cond="chose_move_to")
                select.to(recover.detour, cond="chose_detour")
                select.to(recover.rescan, cond="chose_rescan")
                select.to(gave_up, cond="chose_change_target")
                recovery_done = recover.to(search)
                recovery_failed = recover.to(select)

                reached.to(search, cond="more_targets", on="next_target")
                gave_up.to(search, cond="more_targets", on="chosen_target")

            suspended = State()
            finished = State(final=True)

            start = idle.to(active)
            active.reached.to(finished, unless="more_targets")
            active.gave_up.to(finished, unless="more_targets")
            suspend = active.to(suspended)
            resume = suspended.to(active.resume_here, cond="In('up')")
            abort = idle.to(finished) | active.to(finished) | suspended.to(finished)

        class equipment(State.Compound):  # noqa: N801
            """Whether everything answers that the mission cannot do without: brick, camera, sensors."""

            up = State(initial=True)
            down = State()
            link_lost = up.to(down, on="raise_suspend")
            camera_lost = up.to(down, on="raise_suspend")
            sensor_lost = up.to(down, on="raise_suspend")
            link_back = down.to(up, on="raise_resume")
            camera_back = down.to(up, on="raise_resume")
            sensor_back = down.to(up, on="raise_resume")

        class safety(State.Compound):  # noqa: N801
            """Whether the way ahead is free; the motors have been stopped already when this hears of it."""

            clear = State(initial=True)
            held = State()
            tripped = State()
            obstacle = clear.to(held)
            obstacle_gone = held.to(clear)
            trip = clear.to(tripped, on="raise_abort") | held.to(tripped, on="raise_abort")

    done = State(final=True)
    # a parallel state is only done when all regions are; a finished mission ends the chart by itself
    robot.to(done, cond="In('finished')")

    def __init__(self, queue: TargetQueue, decide: Decide, listeners: Sequence[object] = ()) -> None:
        self.queue = queue
        self._decide = decide
        self.choice: Choice | None = None
        super().__init__(listeners=list(listeners))

    def report(self, fact: Fact) -> None:
        """Tell the chart a fact; facts that mean nothing in the present state change nothing."""
        self.send(fact.event, fact=fact)

    @property
    def states_now(self) -> frozenset[str]:
        """Ids of all active states."""
        return frozenset(state.id for state in self.configuration)

    @property
    def mission_state(self) -> str:
        """The innermost active state of the mission region, or ``finished``."""
        now = self.states_now
        for name in MISSION_STATES:
            if name in now:
                return name
        return "finished"

    @property
    def more_targets(self) -> bool:
        """Guard: whether more targets are left."""
        return self.queue.more_targets

    def chose_wait(self) -> bool:
        """Guard: the policy chose to wait."""
        return self._chose(Recovery.WAIT)

    def chose_move_to(self) -> bool:
        """Guard: the policy chose to look from elsewhere."""
        return self._chose(Recovery.MOVE_TO)

    def chose_detour(self) -> bool:
        """Guard: the policy chose to go round what is in the way."""
        return self._chose(Recovery.DETOUR)

    def chose_rescan(self) -> bool:
        """Guard: the policy chose to look again from here."""
        return self._chose(Recovery.RESCAN)

    def chose_change_target(self) -> bool:
        """Guard: the policy chose to give this target up."""
        return self._chose(Recovery.CHANGE_TARGET)

    def _chose(self, kind: Recovery) -> bool:
        return self.choice is not None and self.choice.kind is kind

    def on_enter_select(self) -> None:
        """Ask the policy, once for every failure; a decision that is broken off leaves no choice behind."""
        self.choice = None
        self.choice = self._decide()

    def on_enter_reached(self) -> None:
        """Write the success down."""
        self.queue.decide(TargetOutcome.REACHED)

    def on_enter_gave_up(self) -> None:
        """Write the failure down."""
        self.queue.decide(TargetOutcome.GIVEN_UP)

    def next_target(self) -> None:
        """Go on to the next target."""
        self.queue.next_target()

    def chosen_target(self) -> None:
        """Go on with the target for which the present one was left, if the policy named one."""
        self.queue.next_target(self.choice.instead if self.choice else "")

    def raise_suspend(self) -> None:
        """An outage suspends the mission."""
        self.raise_(Event.SUSPEND)

    def raise_resume(self) -> None:
        """The end of the outage resumes it where it was."""
        self.raise_(Event.RESUME)

    def raise_abort(self) -> None:
        """A trip ends it."""
        self.raise_(Event.ABORT)


MISSION_STATES = (
    "idle",
    "search",
    "arrive",
    "select",
    "wait",
    "move_to",
    "detour",
    "rescan",
    "reached",
    "gave_up",
    "suspended",
    "finished",
)
"""Leaves of the mission region."""
