"""Tuning constants of the occupancy grid: its model of the sonar, of the camera's view of the floor, and of time."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class GridTuning:
    """Tuning constants of the sonar model and of the map; log odds are not calibrated.

    Attributes:
        arc_deg: An echo's arc is marked this far to either side.
        near_mm: An echo from nearer than this places an obstacle.
        far_mm: An echo from farther than this places nothing; in between it is a hint.
        no_echo_mm: Without an echo the floor is assumed free up to here.
        spared_mm: A line of sight says nothing about the floor this near to the object seen.
        margin_mm: The floor this near to an echo is not marked free.
        hint: Log odds above which a cell may be occupied.
        solid: Log odds above which a cell is occupied.
        most: The highest log odds of a cell; those of free cells are negative.
        most_hint: The highest log odds that hints leave: by themselves they make no cell occupied.
        free_echo: An echo from beyond a cell lowers its log odds by this.
        passed: A farther echo does not come from a cell with log odds below minus this, if it may come from another
            one: the beam is wide, and the edges of a door would close it.
        explains: A cell with higher log odds than this explains a farther echo from its place, to within a cell.
        free_no_echo: A measurement without an echo lowers the log odds by this.
        freest: The lowest log odds that echoes leave.
        freest_no_echo: The lowest log odds that measurements without an echo leave.
        glancing_deg: A surface that gave an echo may deflect a beam that differs by more than this from that one.
        hit_near: A near echo raises the log odds of its arc by this.
        hit_far: A farther one raises them by this.
        arc_cells: Half the width of an echo's arc, in cells.
        repeated_mm: An echo repeats the last one if the robot has moved less than this, turned less than
            `repeated_deg`, and the range differs by less than `repeated_range_mm`.
        repeated_deg: See `repeated_mm`.
        repeated_range_mm: See `repeated_mm`.
        known: A cell with log odds nearer to 0 than this is unknown to a line of sight.
        free: A cell with log odds below minus this is known as free.
        behind: Chance to see past an obstacle on the map: over it, or because the map is wrong.
        unknown_hides_mm: Unknown floor this long hides nothing with probability 1/e.
        decay_s: Log odds fall to 1/e in this time: things move, and odometry drifts.
        decay_every_s: They fall in steps of more than this time.
        appeared_decay_s: Those of an obstacle that stopped the robot where the floor had been free do so in this time:
            it appeared there and may leave again.
        appeared_cells: For an obstacle that appeared, the floor was free up to this many cells behind its echo.
        block_radius_mm: An obstacle of unknown size is marked this large. The camera has overlooked it and does not
            clear it.
        block_beyond: Its middle is marked this share of that radius beyond the place of the echo or the contact.
        block: Log odds of such an obstacle: a few echoes clear it.
        free_seen: Floor that a frame shows to be free lowers the log odds of a cell by this.
        hit_seen: The end of the floor in a frame raises those of its cell by this.
        hit_floor_like: Something that looks like the floor on a ray raises the log odds of all its cells together by up
            to this.
        rare: Log odds against such a thing in an unknown cell.
        floor_like_sharpness: When the cells of a ray share that, each cell's log odds are multiplied by this first: a
            larger one concentrates it on the likeliest cells.
        floor_like_mm: Such a thing is suspected up to this far from the lens.
        floor_like_moved_mm: From another place, this far away, a ray in the same direction says something new.
        floor_like_kept: Each frame multiplies the counts of rays by this, so about the last hundred frames determine
            which share of the rays shows such things.
        seen_margin_mm: The floor this near to where it ends is not marked free.
        same_share: The end of the floor and an echo within this share of its distance are of one thing.
        grazed_mm: An obstacle that the camera saw and the robot touched is marked this large: it came nearer to it than
            the map said.
        grows_cells: The grid grows by this many cells on each side, 3.6 m.
        most_side: Most cells along each axis, 28.8 m on each side: updates of a larger grid take longer.
    """

    arc_deg: float = 11.0
    near_mm: float = 700.0
    far_mm: float = 1800.0
    no_echo_mm: float = 1200.0
    spared_mm: float = 300.0
    margin_mm: float = 100.0
    hint: float = 0.3
    solid: float = 1.5
    most: float = 3.0
    most_hint: float = solid - 0.1
    free_echo: float = 0.35
    passed: float = 0.3
    explains: float = 0.8
    free_no_echo: float = 0.1
    freest: float = -2.0
    freest_no_echo: float = -0.5
    glancing_deg: float = 50.0
    hit_near: float = 1.0
    hit_far: float = 0.5
    arc_cells: float = 0.75
    repeated_mm: float = 25.0
    repeated_deg: float = 2.0
    repeated_range_mm: float = 50.0
    known: float = 0.1
    free: float = 0.2
    behind: float = 0.1
    unknown_hides_mm: float = 2500.0
    decay_s: float = 240.0
    decay_every_s: float = 1.0
    appeared_decay_s: float = 45.0
    appeared_cells: tuple[float, ...] = (0.5, 1.5)
    block_radius_mm: float = 250.0
    block_beyond: float = 0.6
    block: float = 2.2
    free_seen: float = 0.5
    hit_seen: float = 0.8
    hit_floor_like: float = 3.0
    rare: float = 3.0
    floor_like_sharpness: float = 2.0
    floor_like_mm: float = 2500.0
    floor_like_moved_mm: float = 100.0
    floor_like_kept: float = 0.99
    seen_margin_mm: float = 60.0
    same_share: float = 0.25
    grazed_mm: float = 100.0
    grows_cells: int = 45
    most_side: int = 720


TUNING = GridTuning()
