"""The evaluation suite: scenarios, policies side by side, and what came of them by the simulation's truth."""
