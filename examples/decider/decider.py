"""Take the decisions of a mission: `nxtdrive serve` in one terminal, this in another.

The robot searches, drives and looks by itself; after each failure this program is asked what to do. Only the function
`decide` is yours: ask a rule, a person or a language model there.
"""

import json
import socket
import sys

HOST, PORT = "127.0.0.1", 7001


def decide(decision: dict) -> int:
    """Return the number of the candidate to take; this rule takes the one with the fewest seconds for a success."""
    return min(decision["candidates"], key=lambda each: each.get("expected_s") or 1000.0)["number"]


def main(port: int = PORT) -> int:
    """Drive one mission; returns 0 when all targets were reached."""
    try:
        connection = socket.create_connection((HOST, port))
    except ConnectionRefusedError:
        sys.exit(f"Nothing answers on port {port}. Start `nxtdrive serve` first, in another terminal.")
    with connection, connection.makefile("rw", newline="\n") as lines:

        def ask(line: str) -> str:
            print(line, file=lines, flush=True)
            return lines.readline().strip()

        if ask("connect") != "1":
            sys.exit("The brick does not answer, or serves another program.")
        answer = ask("choose")  # begins the mission
        while answer == "0":
            decision = json.loads(ask("evidence"))
            number = decide(decision)
            print(decision["evidence"]["reason"], "->", decision["candidates"][number]["does"])
            answer = ask(f"choose {number}")
        print(json.loads(ask("evidence")))
        ask("bye")
    return 0 if answer == "1" else 1


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
