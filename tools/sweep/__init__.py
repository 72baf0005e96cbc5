"""The evaluation suite: run profiles and baselines on the same scenarios and judge them by the ground truth."""
