"""Tuning constants of the occupancy grid: its model of the sonar, of the camera's view of the floor, and of time.

Log odds are not calibrated.
"""

from __future__ import annotations

ARC_DEG = 11.0
"""An echo's arc is marked this far to either side."""
NEAR_MM = 700.0
"""An echo from nearer than this places an obstacle."""
FAR_MM = 1800.0
"""An echo from farther than this places nothing; in between it is a hint."""
NO_ECHO_MM = 1200.0
"""Without an echo the floor is assumed free up to here."""
SPARED_MM = 300.0
"""A line of sight says nothing about the floor this near to the object seen."""
MARGIN_MM = 100.0
"""The floor this near to an echo is not marked free."""
HINT = 0.3
"""Log odds above which a cell may be occupied."""
SOLID = 1.5
"""Log odds above which a cell is occupied."""
MAX_LOG_ODDS = 3.0
"""The highest log odds of a cell; those of free cells are negative."""
MAX_HINT_LOG_ODDS = SOLID - 0.1
"""The highest log odds that hints leave: by themselves they make no cell occupied."""
FREE_ECHO = 0.35
"""An echo from beyond a cell lowers its log odds by this."""
PASSED_LOG_ODDS = 0.3
"""A farther echo does not come from a cell with log odds below minus this, if it may come from another one: the beam is
wide, and the edges of a door would close it."""
EXPLAINING_LOG_ODDS = 0.8
"""A cell with higher log odds than this explains a farther echo from its place, to within a cell."""
FREE_NO_ECHO = 0.1
"""A measurement without an echo lowers the log odds by this."""
MIN_LOG_ODDS = -2.0
"""The lowest log odds that echoes leave."""
MIN_NO_ECHO_LOG_ODDS = -0.5
"""The lowest log odds that measurements without an echo leave."""
GLANCING_DEG = 50.0
"""A surface that gave an echo may deflect a beam that differs by more than this from that one."""
HIT_NEAR = 1.0
"""A near echo raises the log odds of its arc by this."""
HIT_FAR = 0.5
"""A farther one raises them by this."""
ARC_CELLS = 0.75
"""Half the width of an echo's arc, in cells."""
REPEATED_MM = 25.0
REPEATED_DEG = 2.0
REPEATED_RANGE_MM = 50.0
"""An echo repeats the last one if the robot has moved and turned less, and the range differs less, than these say."""
KNOWN = 0.1
"""A cell with log odds nearer to 0 than this is unknown to a line of sight."""
FREE = 0.2
"""A cell with log odds below minus this is known as free."""
BEHIND_CHANCE = 0.1
"""Chance to see past an obstacle on the map: over it, or because the map is wrong."""
UNKNOWN_HIDES_MM = 2500.0
"""Unknown floor this long hides nothing with probability 1/e."""
DECAY_S = 240.0
"""Log odds fall to 1/e in this time: things move, and odometry drifts."""
DECAY_EVERY_S = 1.0
"""They fall in steps of more than this time."""
APPEARED_DECAY_S = 45.0
"""Those of an obstacle that stopped the robot where the floor had been free do so in this time: it appeared there and
may leave again."""
APPEARED_CELLS = (0.5, 1.5)
"""For an obstacle that appeared, the floor was free up to this many cells behind its echo."""
BLOCK_RADIUS_MM = 250.0
"""An obstacle of unknown size is marked this large. The camera has overlooked it and does not clear it."""
BLOCK_BEYOND = 0.6
"""Its middle is marked this share of that radius beyond the place of the echo or the contact."""
BLOCK_LOG_ODDS = 2.2
"""Log odds of such an obstacle: a few echoes clear it."""
FREE_SEEN = 0.5
"""Floor that a frame shows to be free lowers the log odds of a cell by this."""
HIT_SEEN = 0.8
"""The end of the floor in a frame raises those of its cell by this."""
HIT_FLOOR_LIKE = 3.0
"""Something that looks like the floor on a ray raises the log odds of all its cells together by up to this."""
RARE_LOG_ODDS = 3.0
"""Log odds against such a thing in an unknown cell."""
FLOOR_LIKE_SHARPNESS = 2.0
"""When the cells of a ray share that, each cell's log odds are multiplied by this first: a larger one concentrates it
on the likeliest cells."""
FLOOR_LIKE_MM = 2500.0
"""Such a thing is suspected up to this far from the lens."""
FLOOR_LIKE_MOVED_MM = 100.0
"""From another place, this far away, a ray in the same direction says something new."""
FLOOR_LIKE_KEPT = 0.99
"""Each frame multiplies the counts of rays by this, so about the last hundred frames determine which share of the rays
shows such things."""
SEEN_MARGIN_MM = 60.0
"""The floor this near to where it ends is not marked free."""
SAME_SHARE = 0.25
"""The end of the floor and an echo within this share of its distance are of one thing."""
GRAZED_MM = 100.0
"""An obstacle that the camera saw and the robot touched is marked this large: it came nearer to it than the map
said."""
GROWS_CELLS = 45
"""The grid grows by this many cells on each side, 3.6 m."""
MAX_SIDE = 720
"""Most cells along each axis, 28.8 m on each side: updates of a larger grid take longer."""
