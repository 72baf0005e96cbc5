"""Tuning constants of the belief about where a target is, and of the detector model behind it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class BeliefTuning:
    """Tuning constants of the belief and of the detector model behind it.

    Attributes:
        spacing_mm: Between neighbouring places.
        edge_mm: Between the farthest place and the edge of the map.
        facings: Directions in which a picture may face.
        half_slant_deg: A picture seen more obliquely is found in less than half of the looks. Source: docs/vision.md
            section 1.2, 45 and 60 degrees to the side.
        slant_width_deg: How gradually; the grid of facings is coarse.
        sure: No number of frames from one place counts for more than this: what a detector misses, it misses again.
        viewpoint_mm: Looks from places no farther apart than this are looks from one viewpoint.
        round_frames: Frames that show each place when the robot scans.
        sure_share: Share of its range up to which the detector finds every target; from there on its hit rate falls.
        poor_share: Share of its range at which the hit rate is `poor`; low, since the light is not known.
        poor: Hit rate at `poor_share` of the range.
        blind_share: Share of its range from which the hit rate is 0.
        empty: How plausible a picture is where the sonar found nothing, against 1 at an obstacle.
        unknown: How plausible it is where nothing is known, since there may be no floor at all.
        likely_mm: Standard deviation of the prior around the floor that is known to be free.
        free_cells: A place is on free floor if the cell in its middle is free, or one that far beside it.
        slant_sd_deg: Standard deviation of a picture's slant by its width; half the grid of facings.
        turned: How likely it faces another way than was estimated, against 1 for all.
        steepest_deg: A picture that is seen at all is seen no more obliquely than this.
        scatters: Probability that a target that vanished has moved.
        spike_mm: A target seen at a place is at one of the grid's places this near to it.
        refuted: Share of the belief in a place that remains when the target turned out not to be there.
        trust: Share of the belief that a sighting moves to where it was.
        decay_s: Targets move: belief returns to the prior with this time constant.
        frontier_mm: Unknown floor farther away than this, two rooms, is not seen from a viewpoint at its frontier.
        empty_share: A place is empty when more than this share of the cells around it are free.
        unknown_share: A place is unknown when more than this share of them are.
        overhead_s: Cost of a scan besides the turn: getting here and deciding.
        arc_step_deg: Arcs to look at are multiples of this width.
        arc_bins: Number of these in a full turn.
    """

    spacing_mm: float = 400.0
    edge_mm: float = 400.0
    facings: int = 8
    half_slant_deg: float = 52.0
    slant_width_deg: float = 5.0
    sure: float = 0.95
    viewpoint_mm: float = 350.0
    round_frames: int = 6
    sure_share: float = 0.45
    poor_share: float = 0.95
    poor: float = 0.55
    blind_share: float = 1.05
    empty: float = 0.1
    unknown: float = 0.5
    likely_mm: float = 2500.0
    free_cells: int = 2
    slant_sd_deg: float = 22.5
    turned: float = 0.05
    steepest_deg: float = half_slant_deg + 8.0
    scatters: float = 0.7
    spike_mm: float = 350.0
    refuted: float = 0.02
    trust: float = 0.85
    decay_s: float = 1000.0
    frontier_mm: float = 4000.0
    empty_share: float = 0.8
    unknown_share: float = 0.9
    overhead_s: float = 9.0
    arc_step_deg: float = 10.0
    arc_bins: int = 36


TUNING = BeliefTuning()
