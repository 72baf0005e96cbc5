"""Run an agent in AgentSpeak against ``nxtdrive serve``.

This program is separate from nxtdrive: neither imports the other, and the two communicate over TCP only. It imports
python-agentspeak (``pip3 --python .venv install agentspeak``), whose licence is the GPL, version 3 or later;
distributing both together is subject to that licence.

    nxtdrive serve                                   # in one terminal
    python run_agent.py client.asl                   # in another
    python run_agent.py --unmodified client_portable.asl
"""

from __future__ import annotations

import argparse
import logging
import socket
import sys
from collections import deque
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import agentspeak
import agentspeak.runtime
import agentspeak.stdlib

NAME = "client2"
"""The agent's name in the thesis's console."""


class Connection:
    """A client connection: a request is a line, its reply a number.

    Args:
        host: The host of ``nxtdrive serve``.
        port: Its port.
    """

    def __init__(self, host: str, port: int) -> None:
        self._socket = socket.create_connection((host, port))
        self._replies = self._socket.makefile("r", encoding="ascii")

    def close(self) -> None:
        """Close the connection; the robot's motors stop."""
        self._replies.close()
        self._socket.close()

    def ask(self, request: str) -> int:
        """Send a request and wait for its answer without a time limit."""
        self._socket.sendall(request.encode() + b"\n")
        reply = self._replies.readline()
        if not reply:
            raise agentspeak.AslError("the server has hung up")
        return int(reply)


class JasonAgent(agentspeak.runtime.Agent):
    """An agent whose failure plans run.

    python-agentspeak parses ``-!goal`` plans but ignores them: its agent ends at the first failure. Here, as in Jason,
    a plan that fails makes its goal fail; the failure plan of the innermost goal that has an applicable one runs
    instead, and the goal's caller continues normally. The failure of a failure plan propagates to the caller.
    """

    def step(self) -> bool:
        """Run one instruction; on a failure, run the failure plan."""
        try:
            return bool(super().step())
        except agentspeak.AggregatedError:
            failed = next(stack for stack in self.intentions if stack and stack[-1].waiter is None)
            innermost = failed[-1].head_term
            while failed:
                goal = failed.pop()
                if not getattr(goal, "recovers", False) and self._recover(goal, failed):
                    return True
            raise agentspeak.AslError(f"{innermost} failed, and no failure plan took care of it") from None

    def _recover(self, goal: Any, callers: deque[Any]) -> bool:  # noqa: ANN401 - the library has no types
        removal, achievement = agentspeak.Trigger.removal, agentspeak.GoalType.achievement
        head = goal.head_term
        for plan in self.plans[(removal, achievement, head.functor, len(head.args))]:
            intention = agentspeak.runtime.Intention()
            for _ in agentspeak.unify_annotated(plan.head, head, intention.scope, intention.stack):
                for _ in plan.context.execute(self, intention):
                    intention.head_term, intention.calling_term = head, goal.calling_term
                    intention.instr, intention.recovers = plan.body, True
                    callers.append(intention)
                    return True
        return False


def actions_for(connection: Connection, *, unmodified: bool) -> Any:  # noqa: ANN401 - the library has no types
    """Return the library's actions and ours: ``tcp_write``, and unless `unmodified` a ``.print`` like Jason's."""
    actions = agentspeak.Actions(agentspeak.stdlib.actions)

    @actions.add("tcp_write", 1)
    def tcp_write(agent: Any, term: Any, intention: Any) -> Iterator[None]:  # noqa: ANN401
        request = agentspeak.asl_str(agentspeak.grounded(term.args[0], intention.scope))
        reply = connection.ask(request)
        agent.beliefs[("received", 1)].clear()
        percept = agentspeak.Literal("received", (reply,))
        agent.call(agentspeak.Trigger.addition, agentspeak.GoalType.belief, percept, agentspeak.runtime.Intention())
        yield

    if not unmodified:

        @actions.add(".print")
        def jason_print(agent: Any, term: Any, intention: Any) -> Iterator[None]:  # noqa: ANN401
            memo: dict[Any, Any] = {}
            words = [agentspeak.asl_str(agentspeak.freeze(each, intention.scope, memo)) for each in term.args]
            print(f"[{agent.name}] {''.join(words)}", flush=True)
            yield

    return actions


def main() -> int:
    """Run the agent to its end and return the exit code."""
    parser = argparse.ArgumentParser(description="Run an AgentSpeak agent against `nxtdrive serve`.")
    parser.add_argument("agent", type=Path, metavar="AGENT.asl")
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=7001)
    parser.add_argument("--unmodified", action="store_true", help="python-agentspeak as it is: no failure plans")
    args = parser.parse_args()
    if not args.unmodified:
        # the library would warn that it ignores failure plans, and report failures that a plan handles
        for name in ("agentspeak.parser", "agentspeak.runtime"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
    environment = agentspeak.runtime.Environment()
    agent_class = agentspeak.runtime.Agent if args.unmodified else JasonAgent
    try:
        with args.agent.open(encoding="utf-8") as source, closing(Connection(args.host, args.port)) as connection:
            actions = actions_for(connection, unmodified=args.unmodified)
            agent = environment.build_agent(source, actions, agent_class, NAME)
            environment.run_agent(agent)
    except ConnectionRefusedError:
        print(
            f"Nothing answers on port {args.port}. Start `nxtdrive serve` first, in another terminal.", file=sys.stderr
        )
        return 1
    except (agentspeak.AslError, agentspeak.AggregatedError, OSError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
