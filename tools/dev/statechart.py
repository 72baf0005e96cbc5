"""Write docs/statechart.md and docs/images/statechart.svg from the chart.

``python -m tools.dev.statechart`` in the checkout's root.
"""

from __future__ import annotations

from pathlib import Path

from behaviors.diagram import event_table, guard_table, mermaid, recovery_table, state_table, transition_table

from .program import parser
from .statechart_picture import picture

PAGE = Path("docs/statechart.md")
PICTURE = Path("docs/images/statechart.svg")


PAGE_TEXT = """\
# The statechart of a mission

The states of a mission and the transitions between them, for readers of a [journal](journal.md) and
developers of profiles. `python -m tools.dev.statechart` writes this page from the class `behaviors.chart.MissionChart`;
a test checks that both agree.

[![The statechart of a mission as a picture](images/statechart.svg)](images/statechart.svg)

On a narrow screen, open the picture on its own and enlarge it.

Six regions run side by side. Skills act in the states of *mission* and report facts: an event with its reason and its
measurements. An event without a transition from the current state changes nothing. The motors never wait for the chart:
the safety stop acts first and reports afterwards.

## States

{states}

## Events

{events}

In the [journal](journal.md) each event has its reason and its measurements.

## Transitions

{transitions}

"At once" marks a transition that the chart makes without an event when it enters a state and the guard holds.
`resume_here` and `recover_here` are history states: back to the state that was left.

{guards}

## Recoveries

From the registry in [recoveries.py](../behaviors/recoveries.py); causes as in [evaluation.md](evaluation.md):

{recoveries}

## The same as Mermaid

```mermaid
{mermaid}
```
"""


def page() -> str:
    """Return the page about the chart."""
    return PAGE_TEXT.format(
        states=state_table(),
        events=event_table(),
        transitions=transition_table(),
        guards=guard_table(),
        recoveries=recovery_table(),
        mermaid=mermaid(),
    )


def main() -> None:
    """Write both files."""
    parser(__doc__).parse_args()
    PAGE.write_text(page(), encoding="utf-8")
    PICTURE.write_text(picture(), encoding="utf-8")


if __name__ == "__main__":
    main()
