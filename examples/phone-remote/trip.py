"""Write down the trip of a robot that is driven from a phone; needs `pip install websockets`.

    python trip.py trip.csv [PIN]

It is one more client of `nxtdrive web`: it only watches, and writes where the robot was ten times a second.
"""

import asyncio
import csv
import json
import sys
from pathlib import Path
from urllib.error import HTTPError, URLError
from urllib.request import Request, urlopen

import websockets

PAGE = "127.0.0.1:7080"


def session(page: str, pin: str) -> dict[str, str]:
    """Return the headers of a session: those of a PIN, which `nxtdrive web --lan` asks for, or none."""
    if not pin:
        return {}
    with urlopen(Request(f"http://{page}/api/session", data=pin.encode(), method="POST")) as answer:
        return {"Cookie": answer.headers["Set-Cookie"].partition(";")[0]}


async def watch(file: Path, page: str = PAGE, pin: str = "", rows: int | None = None) -> None:
    """Write a row for each state of the robot until Ctrl-C, or until there are `rows` of them."""
    async with websockets.connect(f"ws://{page}/ws", additional_headers=session(page, pin)) as client:
        with file.open("w", newline="", encoding="utf-8") as opened:
            table = csv.writer(opened)
            table.writerow(["doing", "x_mm", "y_mm", "heading_deg", "range_mm"])
            written = 0
            while rows is None or written < rows:
                message = await client.recv()
                if isinstance(message, bytes):
                    continue  # a picture
                values = json.loads(message)
                if values["type"] == "state":
                    table.writerow([values["doing"], *values["pose"], values["range_mm"]])
                    opened.flush()
                    written += 1


def main(page: str = PAGE) -> None:
    """Write the file of the first argument, with the PIN of the second."""
    if len(sys.argv) < 2:
        sys.exit("Name the file to write: python trip.py trip.csv [PIN]")
    try:
        asyncio.run(watch(Path(sys.argv[1]), page, sys.argv[2] if len(sys.argv) > 2 else ""))
    except (HTTPError, websockets.InvalidStatus):
        sys.exit("The page needs the PIN that `nxtdrive web --lan` prints: python trip.py trip.csv PIN")
    except ConnectionRefusedError:
        sys.exit(f"Nothing answers at {page}. Start `nxtdrive web` first, in another terminal.")
    except URLError as error:
        sys.exit(f"Nothing answers at {page} ({error.reason}). Start `nxtdrive web --lan` first, in another terminal.")
    except websockets.ConnectionClosed:
        print("The page has ended.")
    except KeyboardInterrupt:
        print()  # the usual end


if __name__ == "__main__":
    main()
