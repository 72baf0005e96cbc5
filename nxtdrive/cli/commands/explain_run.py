"""``nxtdrive explain-run``: why the robot did what it did."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import add_json_argument, add_profile_argument
from nxtdrive.cli.output import write_json

if TYPE_CHECKING:
    from behaviors.operator import OperatorChoice
    from nxtdrive.recording.decisions import Decision, Replay
    from nxtdrive.recording.explanation import Explanation

DESCRIPTION = """\
Explain why a robot did what it did: for each decision of a run what had failed,
what was known, the alternatives and their cost, what was chosen and why, and the
outcome; before them the parts of the robot that failed, and at the end the run's
hints at what to check or change. With --profile, also say what its policy would
have chosen there."""
EXAMPLES = """\
  nxtdrive explain-run runs/lena-then-rilakkuma-001
  nxtdrive explain-run runs/lena-then-rilakkuma-001 --profile thesis
  nxtdrive explain-run journal.jsonl --json"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("run_path", metavar="RUN", type=Path, help="a run folder, or its journal.jsonl")
    add_profile_argument(parser, "also give each decision's evidence to the policy of this profile")
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Explain the run and return the exit code."""
    from nxtdrive.recording.explanation import explain
    from nxtdrive.recording.run_reader import read_run

    past = read_run(args.run_path)
    explanation = explain(past, args.profile)
    if args.json:
        write_json(_plain(explanation), indent=2)
        return DONE
    from nxtdrive.cli.views.explanation import show

    show(explanation)
    return DONE


def _plain(explanation: Explanation) -> dict[str, Any]:
    """Return the explanation as plain values."""
    from nxtdrive.recording.progress_lines import equipment_lines

    run = explanation.run
    return {
        "journal": str(run.path),
        "mission": run.name,
        "profile": explanation.profile,
        "numbers": "recorded" if run.mission else "defaults",
        "policy": explanation.policy,
        "complete": run.end is not None,
        "ending": run.end.data.get("ending") if run.end else None,
        "duration_s": run.records[-1].time_s,
        "damaged_lines": list(run.damaged),
        "equipment": [{"t": time_s, "what": what} for time_s, what in equipment_lines(run.records)],
        "hints": list(run.hints),
        "decisions": [
            {
                **_plain_decision(each.decision),
                "candidates": [_plain_candidate(candidate, each.decision) for candidate in each.candidates],
                "replay": _plain_replay(each.replay),
                "what_if": each.what_if.plain() if each.what_if else None,
            }
            for each in explanation.decisions
        ],
    }


def _plain_decision(decision: Decision) -> dict[str, Any]:
    outcome = decision.outcome
    return {
        "t": decision.time_s,
        "target": decision.target,
        "reason": decision.reason,
        "measured": dict(decision.measured),
        "evidence": dict(decision.known),
        "chose": decision.choice.record() if decision.choice else {"choice": decision.chose, "why": decision.why},
        "outcome": {
            "result": outcome.result,
            "target": outcome.target,
            "detail": outcome.detail,
            "seconds": round(outcome.seconds, 3),
            "steps": [
                {"state": step.state, "target": step.target, "seconds": round(step.seconds, 3), "reason": step.reason}
                for step in outcome.steps
            ],
        },
    }


def _plain_candidate(candidate: OperatorChoice, decision: Decision) -> dict[str, Any]:
    from nxtdrive.recording.decisions import same

    weighed, chosen = candidate.weighed, decision.choice
    return {
        **candidate.choice.record(),
        **(weighed.record() if weighed else dict.fromkeys(("seconds", "chance", "expected_s"))),
        "chosen": chosen is not None and same(candidate.choice, chosen),
    }


def _plain_replay(replay: Replay) -> dict[str, Any]:
    choice = replay.choice.record() if replay.choice else None
    return {"choice": choice, "differs": replay.differs, "why_not": replay.why_not}
