"""Teleop on a screen of textual's own, whose pilot presses keys."""

import asyncio

from nxtdrive.tools.teleop.controls import Controls
from nxtdrive.tools.teleop.pilot import Pilot

PATIENCE = 400
"""Looks at something that will happen, before it is held to be missing."""


def app_of(brick, gamepad=None, controls=None, **options):
    from nxtdrive.tools.teleop.app import Teleop

    controls = controls or Controls(300.0, 120.0)
    return Teleop(Pilot(brick, brick.rover(), controls), controls, brick.now, "sim://", gamepad, **options)


def play(app, act, size=(100, 30)):
    """Have `act` use the pilot."""

    async def go():
        async with app.run_test(size=size) as pilot:
            await act(pilot)

    try:
        asyncio.run(go())
    finally:
        app.finish()


async def until(pilot, true, key=None):
    """Wait until something is true; press a key meanwhile."""
    for _ in range(PATIENCE):
        if true():
            return
        if key:
            await pilot.press(key)
        await pilot.pause(0.02)
    raise AssertionError("it never came")


async def until_panel(pilot, words, key=None):
    """Wait until the panel shows some words; press a key meanwhile."""
    await until(pilot, lambda: words in text(pilot.app, "panel"), key)


def widget(app, name):
    return app.screen_stack[0].query_one(f"#{name}")


def text(app, name):
    return str(widget(app, name).render())
