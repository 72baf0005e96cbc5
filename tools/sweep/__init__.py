"""The evaluation suite: run profiles and baselines on the same scenarios and evaluate them by the ground truth."""
