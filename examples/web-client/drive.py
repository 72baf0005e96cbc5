"""Drive forward for two seconds through `nxtdrive web`; needs `pip install websockets`."""

import asyncio
import json

import websockets


async def main() -> None:
    """Become the driver and drive. What the server sends is kept unread, or closing would wait for it."""
    async with websockets.connect("ws://127.0.0.1:7080/ws", max_queue=None) as page:
        print("I am", json.loads(await page.recv())["you"])

        async def drive(ahead: float, seconds: float) -> None:
            for _ in range(int(seconds * 20)):
                await page.send(json.dumps({"type": "drive", "ahead": ahead, "turn": 0.0}))
                await asyncio.sleep(0.05)

        await drive(0.0, 0.05)
        await drive(1.0, 2.0)
        await drive(0.0, 0.05)


asyncio.run(main())
