"""Tuning constants of the belief about where a target is, and of the detector model behind it."""

from __future__ import annotations

SPACING_MM = 400.0
"""Between neighbouring places."""
EDGE_MM = 400.0
"""Between the farthest place and the edge of the map."""
FACINGS = 8
"""Directions in which a picture may face."""
HALF_SLANT_DEG = 52.0
"""A picture seen more obliquely is found in less than half of the looks. Source: docs/ranges.md section 1.2, 45 and 60
degrees to the side."""
SLANT_WIDTH_DEG = 5.0
"""How gradually; the grid of facings is coarse."""
MAX_FOUND_CHANCE = 0.95
"""No number of frames from one place counts for more than this: what a detector misses, it misses again."""
VIEWPOINT_MM = 350.0
"""Looks from places no farther apart than this are looks from one viewpoint."""
ROUND_FRAMES = 6
"""Frames that show each place when the robot scans."""
SURE_SHARE = 0.45
"""Share of its range up to which the detector finds every target; from there on its hit rate falls."""
POOR_SHARE = 0.95
"""Share of its range at which the hit rate is `POOR_HIT_RATE`; low, since the light is not known."""
POOR_HIT_RATE = 0.55
"""Hit rate at `POOR_SHARE` of the range."""
BLIND_SHARE = 1.05
"""Share of its range from which the hit rate is 0."""
EMPTY_PLAUSIBILITY = 0.1
"""How plausible a picture is where the sonar found nothing, against 1 at an obstacle."""
UNKNOWN_PLAUSIBILITY = 0.5
"""How plausible it is where nothing is known, since there may be no floor at all."""
LIKELY_MM = 2500.0
"""Standard deviation of the prior around the floor that is known to be free."""
FREE_CELLS = 2
"""A place is on free floor if the cell in its middle is free, or one that far beside it."""
SLANT_SD_DEG = 22.5
"""Standard deviation of a picture's slant by its width; half the grid of facings."""
TURNED_WEIGHT = 0.05
"""How likely it faces another way than was estimated, against 1 for all."""
STEEPEST_DEG = HALF_SLANT_DEG + 8.0
"""A picture that is seen at all is seen no more obliquely than this."""
MOVED_CHANCE = 0.7
"""Probability that a target that vanished has moved."""
SPIKE_MM = 350.0
"""A target seen at a place is at one of the grid's places this near to it."""
REFUTED_SHARE = 0.02
"""Share of the belief in a place that remains when the target turned out not to be there."""
SIGHTING_SHARE = 0.85
"""Share of the belief that a sighting moves to where it was."""
DECAY_S = 1000.0
"""Targets move: belief returns to the prior with this time constant."""
FRONTIER_MM = 4000.0
"""Unknown floor farther away than this, two rooms, is not seen from a viewpoint at its frontier."""
EMPTY_SHARE = 0.8
"""A place is empty when more than this share of the cells around it are free."""
UNKNOWN_SHARE = 0.9
"""A place is unknown when more than this share of them are."""
OVERHEAD_S = 9.0
"""Cost of a scan besides the turn: getting here and deciding."""
ARC_STEP_DEG = 10.0
"""Arcs to look at are multiples of this width."""
ARC_BINS = round(360.0 / ARC_STEP_DEG)
"""Number of these in a full turn."""
