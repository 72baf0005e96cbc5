"""The statechart of a mission.

Five regions run side by side. *mission* is the thesis's client: search, arrive, select, then a recovery, and so on to
the next target. *equipment* and *safety* supervise it: an outage suspends the mission from any state, a trip ends it
from any state, without an arrow from each. *camera* and *floor_map* say what the robot can rely on.

The rules of this file: every transition is declared here with guards, without code; events are facts
(`behaviors.events`); skills (`behaviors.skills`) act in a state; policies (`behaviors.recoveries`) choose; nothing here
depends on time. The motors never wait for the chart: the safety stop acts first and reports the fact afterwards.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from statemachine import HistoryState, State, StateChart

from behaviors.events import RESULTS, Event, Fact
from behaviors.recoveries import Choice, recovery_in
from behaviors.target_queue import TargetOutcome, TargetQueue

Decide = Callable[[], Choice]


class MissionChart(StateChart[Any]):
    """A mission from start to finish.

    Args:
        queue: The targets; a guard checks whether more are left.
        decide: Called on entry of `select`; returns the choice that the guards check.
        listeners: Objects with ``after_transition(event, source, target, ...)``, for journals and displays.
    """

    # an exception in a callback must reach the executive, which stops the motors; as an event it would be lost
    catch_errors_as_events = False

    class robot(State.Parallel):  # noqa: N801 - states are named as events are
        """The six regions."""

        class mission(State.Compound):  # noqa: N801
            """The pursuit of the targets."""

            idle = State(initial=True)

            class active(State.Compound):  # noqa: N801
                """Pursuing a target."""

                search = State(initial=True)
                arrive = State()
                verify = State()
                retreat = State()
                select = State()

                class recover(State.Compound):  # noqa: N801
                    """Improving the chance of the next search."""

                    wait = State(initial=True)
                    move_to = State()
                    detour = State()
                    rescan = State()
                    recover_here = HistoryState()

                reached = State()
                left = State()
                gave_up = State()
                resume_here = HistoryState(type="deep")

                target_seen = search.to(arrive) | recover.to(arrive)
                search_failed = search.to(select)
                # not internal: 3.2.2 enters the initial states of all regions on an internal self-transition
                continued = arrive.to(arrive) | verify.to(verify)
                doubted = arrive.to(verify)
                moved_off = verify.to(arrive)
                arrived = arrive.to(reached) | verify.to(reached)
                mistaken = arrive.to(select) | verify.to(select)
                backing_off = arrive.to(retreat) | recover.move_to.to(retreat) | recover.detour.to(retreat)
                retreated = retreat.to(recover.recover_here)
                arrive_failed = arrive.to(select) | verify.to(select) | retreat.to(select)

                select.to(recover.wait, cond="chosen")
                select.to(recover.move_to, cond="chosen")
                select.to(recover.detour, cond="chosen")
                select.to(recover.rescan, cond="chosen")
                select.to(left, cond=["chosen", "another_round"])
                select.to(gave_up, cond="chosen", unless="another_round")
                replanned = recover.move_to.to(recover.move_to) | recover.detour.to(recover.detour)
                recovery_done = recover.to(search)
                recovery_failed = recover.to(select)

                reached.to(search, cond="more_targets", on="next_target")
                left.to(search, on="chosen_target")
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
            """Whether everything that the mission needs answers: brick, camera, sensors."""

            up = State(initial=True)
            down = State()
            link_lost = up.to(down, on="raise_suspend")
            camera_lost = up.to(down, on="raise_suspend")
            sensor_lost = up.to(down, on="raise_suspend")
            link_back = down.to(up, on="raise_resume")
            camera_back = down.to(up, on="raise_resume")
            sensor_back = down.to(up, on="raise_resume")

        class safety(State.Compound):  # noqa: N801
            """Whether the path ahead is free; the motors have already stopped when this is reported."""

            clear = State(initial=True)
            held = State()
            tripped = State()
            obstacle = clear.to(held)
            contact = held.to(held)
            obstacle_gone = held.to(clear)
            trip = clear.to(tripped, on="raise_abort") | held.to(tripped, on="raise_abort")

        class camera(State.Compound):  # noqa: N801
            """Whether frames arrive."""

            seeing = State(initial=True)
            blind = State()
            camera_lost = seeing.to(blind)
            camera_back = blind.to(seeing)

        class floor_map(State.Compound):  # noqa: N801
            """Whether what the map shows in the way stops an approach."""

            trusted = State(initial=True)
            distrusted = State()
            map_distrusted = trusted.to(distrusted)
            map_trusted = distrusted.to(trusted)
            map_cleared = trusted.to(trusted) | distrusted.to(distrusted)
            turns_corrected = trusted.to(trusted) | distrusted.to(distrusted)

        class wheels(State.Compound):  # noqa: N801
            """Whether both wheels grip the floor."""

            gripping = State(initial=True)
            slipping = State()
            wheel_slips = gripping.to(slipping)
            wheel_grips = slipping.to(gripping)

    done = State(final=True)
    # a parallel state is done only when all its regions are; here a finished mission ends the chart
    robot.to(done, cond="In('finished')")

    def __init__(self, queue: TargetQueue, decide: Decide, listeners: Sequence[object] = ()) -> None:
        self.queue = queue
        self._decide = decide
        self.choice: Choice | None = None
        super().__init__(listeners=list(listeners))

    def report(self, fact: Fact) -> None:
        """Report a fact; one that means nothing in the current state changes nothing."""
        self.send(fact.event, fact=fact)

    @property
    def states_now(self) -> frozenset[str]:
        """The ids of all active states."""
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
        """Guard: more targets are left."""
        return self.queue.more_targets

    @property
    def another_round(self) -> bool:
        """Guard: the current target is tried again in a later round."""
        return self.queue.another_round

    def chosen(self, target: State) -> bool:
        """Guard: the policy chose the recovery that leads to this state."""
        return self.choice is not None and self.choice.kind is recovery_in(target.id)

    def on_enter_select(self) -> None:
        """Choose a recovery, once for every failure; a decision that is interrupted leaves no choice behind."""
        self.choice = None
        self.choice = self._decide()

    def on_enter_reached(self) -> None:
        """Record the success."""
        self.queue.decide(TargetOutcome.REACHED)

    def on_enter_gave_up(self) -> None:
        """Record the failure."""
        self.queue.decide(TargetOutcome.GIVEN_UP)

    def next_target(self) -> None:
        """Continue with the next target."""
        self.queue.next_target()

    def chosen_target(self) -> None:
        """Continue with the target that the policy named, if any, else with the next one."""
        self.queue.next_target(self.choice.instead if self.choice else "")

    def raise_suspend(self) -> None:
        """Suspend the mission in an outage."""
        self.raise_(Event.SUSPEND)

    def raise_resume(self) -> None:
        """Resume it where it was when the outage is over."""
        self.raise_(Event.RESUME)

    def raise_abort(self) -> None:
        """End it on a trip."""
        self.raise_(Event.ABORT)


def _leaves(state: State) -> Iterator[State]:
    if not state.states:
        yield state
    for child in state.states:
        yield from _leaves(child)


ROBOT = next(state for state in MissionChart.states if state.id == "robot")
_MISSION_LEAVES = {leaf.id: leaf for leaf in _leaves(next(region for region in ROBOT.states if region.id == "mission"))}
MISSION_STATES = tuple(_MISSION_LEAVES)
"""Leaves of the mission region."""


def results_in(state: str) -> list[Event]:
    """Return the events with which a skill can end in a leaf of the mission region, by the declared transitions."""
    leaf = _MISSION_LEAVES[state]
    declared = {transition.event for each in (leaf, leaf.parent) if each for transition in each.transitions}
    return [event for event in RESULTS if event in declared]
