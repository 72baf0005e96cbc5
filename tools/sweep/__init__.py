"""The evaluation suite: run policies on the same scenarios and judge them by the simulation's ground truth."""
