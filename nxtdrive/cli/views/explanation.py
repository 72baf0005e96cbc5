"""Print a run's explanation for ``nxtdrive explain-run``."""

from __future__ import annotations

from rich.cells import cell_len
from rich.console import Console, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from behaviors.profile_names import THESIS
from firmware_protocol.printable import printable
from nxtdrive.cli.output import make_console
from nxtdrive.cli.views.decision import CandidateTable, known_lines
from nxtdrive.recording.decisions import Decision, DecisionResult, StateSpan, same
from nxtdrive.recording.explanation import ExplainedDecision, Explanation
from nxtdrive.recording.progress_lines import equipment_lines
from nxtdrive.recording.wording import measured_words, reason_words, spaced, state_words

SHOWN = 8
"""Largest number of lines about parts that failed or worked again."""
LEFT = {"left": "left for now", "gave_up": "given up"}
RULE = (
    "the thesis's rule: recognised but not reached, wait; not recognised, move off; searched again too often, leave it"
)

UNKNOWN = (
    "this version can read no mission.json here: the profile is not known, and candidates are the adaptive profile's "
    "with its default parameters. Copy the run's whole folder"
)


def show(explanation: Explanation, console: Console | None = None) -> None:
    """Print an explanation.

    Args:
        explanation: The run's decisions with their outcomes.
        console: The terminal; standard output by default.
    """
    console = console or make_console()
    for line in _head(explanation, console.width):
        console.print(line)
    for line in _equipment(explanation):
        console.print(line)
    if not explanation.decisions:
        console.print("The journal contains no decision: no attempt had failed.")
    for number, each in enumerate(explanation.decisions, start=1):
        decision = each.decision
        title = Text(printable(f"{number}  {decision.time_s:.1f} s  {decision.target}"))
        console.print(Panel(_body(each, explanation), title=title, title_align="left"))
    if explanation.other_policy and explanation.decisions:
        console.print(_sum(explanation))
    for hint in explanation.run.hints:
        console.print(Text(printable(f"hint: {hint}")))


def _head(explanation: Explanation, width: int) -> list[Text]:
    run = explanation.run
    last_s = run.records[-1].time_s
    if run.end is None:
        ended = f"unfinished: the journal ends at {last_s:.1f} s"
    else:
        ended = f"{spaced(str(run.end.data.get('ending', 'ended')))} after {last_s:.1f} s"
    parts = [run.name or run.path.name, f"profile {explanation.profile or 'not known'}", ended]
    notes = []
    if run.damaged:
        lines = f"line{'s' * (len(run.damaged) > 1)} {', '.join(map(str, run.damaged))}"
        notes.append(f"{lines} of the journal cannot be read and {'are' if len(run.damaged) > 1 else 'is'} left out")
    if run.mission is None:
        notes.append(UNKNOWN)
    if explanation.unavailable:
        notes.append(f"{explanation.unavailable} Until then its candidates are not shown.")
    title = printable("  |  ".join(parts))
    if cell_len(title) > width:
        title = "\n".join(map(printable, parts))
    return [Text(title, style="bold"), *(Text(note, style="yellow") for note in notes)]


def _equipment(explanation: Explanation) -> list[Text]:
    """Report the parts that failed, and the error that ended the run unless it is one of theirs."""
    run = explanation.run
    lines = equipment_lines(run.records)
    texts = [f"{time_s:.1f} s  {what}" for time_s, what in lines[:SHOWN]]
    if len(lines) > SHOWN:
        texts.append(f"and so on: {len(lines)} such lines in all")
    error = run.end.data.get("error") if run.end else None
    if error and error not in [what for _, what in lines[:SHOWN]]:
        texts.append(f"error: {error}")
    return [Text(printable(text), style="yellow") for text in texts]


def _body(each: ExplainedDecision, explanation: Explanation) -> Table:
    decision = each.decision
    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="dim", no_wrap=True)
    grid.add_column()
    measured = measured_words(decision.measured)
    failed = f"{reason_words(decision.reason, decision.measured)}{measured and f' ({measured})'}"
    grid.add_row("failed", printable(failed))
    grid.add_row("known", known_lines(decision.evidence) if decision.evidence else _raw(each))
    grid.add_row("could", _candidates(each, explanation))
    grid.add_row("chose", _chosen(each))
    grid.add_row("then", Text(outcome_words(decision)))
    if each.what_if:
        grid.add_row("what if", Text(each.what_if.words()))
    for label, text in _replayed(each, explanation):
        grid.add_row(label, text)
    return grid


def _raw(each: ExplainedDecision) -> Text:
    known = ", ".join(f"{name}: {value}" for name, value in each.decision.known.items())
    return Text(printable(known) or "nothing is recorded")


def _candidates(each: ExplainedDecision, explanation: Explanation) -> RenderableType:
    choice = each.decision.choice
    if not each.candidates:
        if explanation.unavailable:
            return "the profile cannot be loaded here"
        return RULE if explanation.profile == THESIS else "the journal has no candidates"
    matching = (i for i, one in enumerate(each.candidates) if choice is not None and same(one.choice, choice))
    chosen = next(matching, None)
    marks = [">" if i == chosen else "" for i in range(len(each.candidates))]
    return CandidateTable(each.candidates, marks, chosen)


def _chosen(each: ExplainedDecision) -> Text:
    decision = each.decision
    choice = decision.choice
    text = Text(printable(choice.words() if choice else spaced(decision.chose)), style="bold")
    text.append(printable(f": {decision.why}" if decision.why else ""), style="not bold")
    if choice and choice.proposed:
        proposed = f"the policy had proposed: {choice.proposed.words()}, since {choice.proposed.why}"
        text.append("\n" + printable(proposed), style="not bold")
    elif choice and choice.operator:
        text.append(" (confirmed by the operator)", style="not bold")
    return text


def outcome_words(decision: Decision) -> str:
    """Describe what a decision led to."""
    outcome = decision.outcome
    steps = [_step_words(step, outcome.target) for step in outcome.steps]
    reasons = [f" ({reason_words(step.reason)})" if step.reason else "" for step in outcome.steps]
    if outcome.result is DecisionResult.FAILED and reasons:
        reasons[-1] = ""  # the next line describes the failure
    path = ", ".join(map("".join, zip(steps, reasons, strict=True)))
    after = f"after {outcome.seconds:.1f} s"
    match outcome.result:
        case DecisionResult.FAILED:
            again = "again " if outcome.target == decision.target else ""
            end = f"the attempt at {outcome.target} failed {again}{after}: {reason_words(outcome.detail)}"
        case DecisionResult.REACHED:
            end = f"{outcome.target} reached {after}"
        case DecisionResult.FINISHED:
            end = f"the mission ended {after}: {spaced(outcome.detail) or 'how is not recorded'}"
        case DecisionResult.OPEN:
            end = f"the journal ends {after}"
    return "\n".join(map(printable, filter(None, (path, end))))


def _step_words(step: StateSpan, target: str) -> str:
    if step.state in LEFT:
        return f"{step.target} {LEFT[step.state]}"
    name = state_words(step.state) + ("" if step.target == target else f" {step.target}")
    return f"{name} {step.seconds:.1f} s"


def _replayed(each: ExplainedDecision, explanation: Explanation) -> list[tuple[str, Text]]:
    """Show what the given policy would have chosen; the run's own policy only if it would choose differently now."""
    replay, choice, other = each.replay, each.decision.choice, explanation.other_policy
    if replay.choice is None:
        return [(other, Text(f"unknown: {replay.why_not}", style="yellow"))] if other else []
    if not replay.differs:
        return [(other, Text("would have chosen the same", style="green"))] if other else []
    other_choice = printable(f"{replay.choice.words()}, since {replay.choice.why}")
    if other:
        return [(other, Text(f"would have chosen differently: {other_choice}", style="yellow"))]
    if choice is None or choice.proposed:
        return []
    return [("today", Text(f"this version chooses differently: {other_choice}", style="yellow"))]


def _sum(explanation: Explanation) -> Text:
    replays = [each.replay for each in explanation.decisions if each.replay.choice is not None]
    if not replays:
        return Text(f"This journal does not show what {explanation.policy} would have chosen.")
    differing = sum(replay.differs for replay in replays)
    text = f"{explanation.policy} would have chosen differently in {differing} of {len(replays)} decisions"
    left_out = len(explanation.decisions) - len(replays)
    text += f"; {left_out} unknown" if left_out else ""
    return Text(f"{text}. After the first different choice the run itself would have gone differently.")
