"""Measure how accurately the end of the free floor is detected, in rendered rooms.

    python -m tools.dev.free_floor_accuracy [--rooms 80] [--places 4] [--seed 1] [--conditions "plain,JPEG 20"]

Each room has one floor, one wall and boxes or persons of one texture; all combinations take turns. The detector learns
as it does on a robot: from frames with nothing within the sonar's 700 mm. The true end of the floor comes from the
same view at twice the resolution, with a flat colour for each kind of surface. The tables of docs/ranges.md section 3
come from here.
"""

from __future__ import annotations

import itertools
import math
import random
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from statistics import fmean

import numpy as np
from numpy.typing import NDArray

from behaviors.adaptive.perception import FREE_MM
from behaviors.angles import wrapped_deg
from nxtdrive.vision.free_floor import COLUMNS, RUN_PX, WIDTH_PX, FreeFloorDetector
from nxtdrive.vision.geometry import Mounting
from nxtdrive.vision.geometry import Pinhole as DetectorPinhole
from sim_backend.camera.geometric_floor import FloorModel, GeometricFloor
from sim_backend.camera.lens import PERFECT, Lens, LensEffects
from sim_backend.camera.projection import Pinhole
from sim_backend.camera.scene import Panel, Viewpoint, standing_panels
from sim_backend.camera.sim_camera import SimCamera
from sim_backend.camera.textures import Color, Image, Texture, TextureLibrary
from sim_backend.plane import sides_of

from .detector_ranges import FLOORS, WALLS
from .program import parser

PERSONS = ("person_blue", "person_green")
BOXES = ("wood", "cardboard", "carton", "crate", "red_box", "blue_box", "green_box", "yellow_box", *PERSONS)
RUGS: tuple[Color, ...] = ((60, 60, 140), (110, 70, 50), (190, 205, 215), (70, 70, 70))
"""Wine red, dark blue, beige, grey."""

FLOOR, RUG, WALL, BOX = (255, 255, 255), (0, 255, 0), (255, 0, 0), (0, 0, 255)
"""Colours of the kinds of surfaces; everything above the walls is nearly white."""

LENS_MM = 200.0
WALL_MM = 2500.0
CONE_DEG = 15.0
"""Half of the sonar's cone."""

LEARNED = 10
"""Number of frames in each room from which the detector learns."""
TRIES = 2000
FINER = 2
NEAR_PX = 2.5
"""A row is right within this, in pixels of a frame `WIDTH_PX` wide."""
ALIKE = 0.5
"""Textures with more than this share of rays that end too far, or have no result, cannot be distinguished."""
TILES = 4
"""Rugs and shadows on the floor repeat after this many widths of the floor's texture."""


@dataclass(frozen=True, slots=True)
class Condition:
    """How the frames differ from those of a good camera in a well-lit room.

    Attributes:
        turn_deg_s: The robot turns while it looks, not while it learns.
        brightness: Factor by which the frame is brighter than those of learning.
        fade: Light falls off over the frame, in any direction, from this share more to this share less.
        shadow: Stripes of the floor have this share of the light.
        rug: Rugs lie on the floor.
        effects: The camera.
        size: Size of the frames.
        tilt_deg: Angle by which the camera looks up.
    """

    turn_deg_s: float = 0.0
    brightness: float = 1.0
    fade: float = 0.0
    shadow: float = 1.0
    rug: bool = False
    effects: LensEffects = field(default_factory=LensEffects)
    size: tuple[int, int] = (320, 240)
    tilt_deg: float = 0.0


CONDITIONS = {
    "plain": Condition(),
    "turning at 36 deg/s": Condition(turn_deg_s=36.0),
    "suddenly x0.7": Condition(brightness=0.7),
    "suddenly x1.4": Condition(brightness=1.4),
    "light falls off": Condition(fade=0.25),
    "hard shadow": Condition(shadow=0.6),
    "JPEG 20": Condition(effects=LensEffects(jpeg_quality=20)),
    "rug": Condition(rug=True),
    "640x480": Condition(size=(640, 480)),
    "tilted by -10 deg": Condition(tilt_deg=-10.0),
    "double noise": Condition(effects=LensEffects(noise=8.0)),
}


@dataclass(frozen=True, slots=True)
class Room:
    """Objects and floor of a room, and places to look from, beginning with those for learning."""

    floor: str
    wall: str
    box: str
    panels: Sequence[Panel]
    learned_from: Sequence[Viewpoint]
    places: Sequence[Viewpoint]


@dataclass(frozen=True, slots=True)
class Ray:
    """One direction of a frame. Rows are those of a frame `WIDTH_PX` wide, from its upper edge.

    Attributes:
        floor: Texture of the floor.
        obstacle: Texture of the obstacle that ends the floor.
        end_px: Row in which the floor ends.
        rug_px: Row in which a rug begins; None without one in front of the obstacle.
        seen_px: Row in which the detector sees the end; None without a result, or with one above the horizon.
        goes_on: Whether the floor's colours go on above the horizon.
        tall: Whether the obstacle reaches above the horizon of a level camera.
    """

    floor: str
    obstacle: str
    end_px: float
    rug_px: float | None
    seen_px: float | None
    goes_on: bool
    tall: bool

    @property
    def error_px(self) -> float:
        """How much too low the row is, which means too near."""
        return math.nan if self.seen_px is None else self.seen_px - self.end_px


class PatternedTextures(TextureLibrary):
    """The bundled textures, with a floor that has rugs or shadows on it.

    Args:
        seed: Seed of the textures.
        floor: The floor's name.
        condition: Which of these lie on it.
        rng: Chooses the places.

    Attributes:
        rugs: A floor for `SurfaceColors`.
    """

    def __init__(self, seed: int, floor: str, condition: Condition, rng: random.Random) -> None:
        super().__init__(seed)
        plain, self._name = super().__getitem__(floor), floor
        pixels, kinds = np.tile(plain.pixels, (TILES, TILES, 1)), np.full((8, 8, 3), FLOOR, np.uint8)
        size, tile_mm = len(pixels), (plain.tile_mm or 1000.0) * TILES
        if condition.shadow < 1.0:
            stripe = np.add.outer(np.arange(size), np.arange(size)) % (size // 2) < size // 10
            pixels[stripe] = (pixels[stripe] * condition.shadow).astype(np.uint8)
        if condition.rug:
            kinds = np.full(pixels.shape, FLOOR, np.uint8)
            grain = np.random.default_rng(rng.randrange(1 << 30))
            for color in rng.sample(RUGS, 2):
                left, top = (round(rng.uniform(0.0, 0.75) * size) for _ in range(2))
                place = slice(top, top + round(0.17 * size)), slice(left, left + round(0.25 * size))
                noise = grain.normal(0.0, 6.0, (*pixels[place].shape[:2], 1))
                pixels[place] = (np.array(color) + noise).clip(0, 255).astype(np.uint8)
                kinds[place] = RUG
        self._floor, self.rugs = Texture(pixels, tile_mm), Texture(kinds, tile_mm)

    def __getitem__(self, name: str) -> Texture:
        """Return the texture called `name`."""
        return self._floor if name == self._name else super().__getitem__(name)


class SurfaceColors(TextureLibrary):
    """A flat colour for each kind of surface."""

    def __init__(self, room: Room, floor: Texture) -> None:
        super().__init__()
        wall, box = (Texture(np.full((8, 8, 3), color, np.uint8)) for color in (WALL, BOX))
        self._textures = {room.wall: wall, room.box: box, room.floor: floor}

    def __getitem__(self, name: str) -> Texture:
        """Return the colour of a texture's kind."""
        return self._textures[name]


def make_room(number: int, places: int, seed: int) -> Room:
    """Draw a room; the combinations of textures take turns."""
    mixed = list(itertools.product(FLOORS, WALLS, BOXES))
    random.Random(seed).shuffle(mixed)  # noqa: S311 - a repeatable draw
    floor, wall, box = mixed[number % len(mixed)]
    rng = random.Random(f"{seed}/{number}")  # noqa: S311 - a repeatable draw
    wide, deep = rng.uniform(3000.0, 5000.0), rng.uniform(3000.0, 5000.0)
    corners = [(0.0, 0.0), (wide, 0.0), (wide, deep), (0.0, deep)]
    panels = [Panel(*one, *other, 0.0, WALL_MM, wall) for one, other in sides_of(corners)]
    taken = []
    for _ in range(rng.randint(3, 7)):
        x, y, first_deg = rng.uniform(400.0, wide - 400.0), rng.uniform(400.0, deep - 400.0), rng.uniform(0.0, 90.0)
        reach, high = (150.0, 1700.0) if box in PERSONS else (rng.uniform(60.0, 300.0), rng.uniform(120.0, 500.0))
        turns = [math.radians(first_deg + 90.0 * side) for side in range(4)]
        sides = [(x + reach * math.cos(turn), y + reach * math.sin(turn)) for turn in turns]
        panels += standing_panels(sides, high, box)
        taken.append((x, y, reach + 150.0))
    learned_from: list[Viewpoint] = []
    seen_from: list[Viewpoint] = []
    for _ in range(TRIES):
        x, y = rng.uniform(250.0, wide - 250.0), rng.uniform(250.0, deep - 250.0)
        viewpoint = Viewpoint(x, y, rng.uniform(0.0, 360.0), LENS_MM)
        if any(math.dist((x, y), centre) < reach for *centre, reach in taken):
            continue
        if len(learned_from) < LEARNED and free_ahead_mm(panels, viewpoint) > FREE_MM:
            learned_from.append(viewpoint)
        elif len(seen_from) < places:
            seen_from.append(viewpoint)
    return Room(floor, wall, box, panels, learned_from, seen_from)


def free_ahead_mm(panels: Sequence[Panel], viewpoint: Viewpoint) -> float:
    """Return the distance of the nearest object in the sonar's cone."""
    nearest_mm = math.inf
    for x, y, _ in GeometricFloor(model=FloorModel(0.0, frozenset(), 0.0)).ends(
        panels, viewpoint, Pinhole(320, 240, 60.0)
    ):
        bearing_deg = math.degrees(math.atan2(y - viewpoint.y_mm, x - viewpoint.x_mm)) - viewpoint.heading_deg
        if abs(wrapped_deg(bearing_deg)) <= CONE_DEG:
            nearest_mm = min(nearest_mm, math.dist((x, y), (viewpoint.x_mm, viewpoint.y_mm)))
    return nearest_mm


def measure(room: Room, condition: Condition, seed: int) -> Iterable[Ray]:
    """Yield the directions in which floor is visible in a room."""
    rng = random.Random(seed)  # noqa: S311 - a repeatable draw
    textures = PatternedTextures(seed, room.floor, condition, rng)
    camera = SimCamera(condition.size, lens=PERFECT, floor=room.floor, textures=textures)
    fine = WIDTH_PX * FINER, condition.size[1] * WIDTH_PX * FINER // condition.size[0]
    kinds = SimCamera(fine, lens=PERFECT, floor=room.floor, textures=SurfaceColors(room, textures.rugs))
    lens = Lens(condition.effects, condition.size, camera.pinhole.focal_px, seed)
    pinhole = DetectorPinhole.from_hfov(condition.size[0], mounting=Mounting(tilt_deg=condition.tilt_deg))
    detector = FreeFloorDetector()

    def frame(viewpoint: Viewpoint, turn_deg_s: float = 0.0, brightness: float = 1.0) -> Image:
        image = camera.frame(room.panels, viewpoint)
        if condition.fade:
            image = faded(image, condition.fade, rng.uniform(0.0, 2 * math.pi))
        return lens.expose(image, turn_deg_s, brightness)

    for number, place in enumerate(room.learned_from):
        detector.keep(frame(replace(place, tilt_deg=condition.tilt_deg)), number)
        detector.learn(number)
    for place in room.places:
        place = replace(place, tilt_deg=condition.tilt_deg)
        ends = detector.ends(frame(place, condition.turn_deg_s, condition.brightness))
        below = pinhole.directions(*ends.T)[1] > 0.0
        ends *= WIDTH_PX / condition.size[0]
        yield from compare(room, kinds.frame(room.panels, place), ends[below], ends[~below])


def faded(image: Image, share: float, towards: float) -> Image:
    """Return a frame in which light falls off in a direction."""
    height, width = image.shape[:2]
    x, y = np.linspace(-1.0, 1.0, width) * math.cos(towards), np.linspace(-1.0, 1.0, height) * math.sin(towards)
    light = 1.0 + share * np.add.outer(y, x) / (abs(math.cos(towards)) + abs(math.sin(towards)))
    return np.asarray((image * light[..., None]).clip(0, 255), np.uint8)


def compare(room: Room, kinds: Image, below: NDArray[np.float64], above: NDArray[np.float64]) -> Iterable[Ray]:
    """Yield the directions in which a frame of kinds shows floor, with the results below and above the horizon."""
    seen = {int(u * COLUMNS / WIDTH_PX): float(v) for u, v in below}
    goes_on = {int(u * COLUMNS / WIDTH_PX) for u, _ in above}
    for column in range(COLUMNS):
        upwards = kinds[::-1, int((column + 0.5) / COLUMNS * WIDTH_PX) * FINER + FINER // 2]
        solid, rug = upwards[:, 1] < 128, (upwards[:, 1] >= 128) & (upwards[:, 2] < 128)
        first = int(solid.argmax())
        if first < FINER * RUN_PX:
            continue
        obstacle = room.box if upwards[first, 2] > upwards[first, 0] else room.wall
        begins = int(rug[:first].argmax())
        rug_px = (len(upwards) - begins) / FINER if begins else None
        tall = bool((upwards[first : len(upwards) // 2 + 1] == upwards[first]).all())
        yield Ray(
            room.floor, obstacle, (len(upwards) - first) / FINER, rug_px, seen.get(column), column in goes_on, tall
        )


def row(name: str, rays: Sequence[Ray]) -> str:
    """Return a row of the table."""
    errors = np.array([ray.error_px for ray in rays if ray.seen_px is not None])
    if not len(errors):
        return f"| {name} | {len(rays)} | 0 % |" + " - |" * 5
    low, middle, high = np.percentile(errors, (25, 50, 75))
    shares = (np.abs(errors) <= NEAR_PX).mean(), (errors < -NEAR_PX).mean(), (errors > NEAR_PX).mean()
    cells = [f"{100 * len(errors) / len(rays):.1f} %", f"{middle:+.2f}", f"{(high - low) / 1.349:.2f}"]
    return f"| {name} | {len(rays)} | {' | '.join(cells)} | {' | '.join(f'{100 * each:.1f} %' for each in shares)} |"


def alike(rays: Sequence[Ray]) -> Iterable[str]:
    """Yield the pairs of floor and obstacle that some rays overlook, worst first, and figures of those alike."""
    pairs: Mapping[tuple[str, str], list[bool]] = defaultdict(list)
    for ray in rays:
        pairs[ray.floor, ray.obstacle].append(ray.seen_px is None or ray.error_px < -NEAR_PX)
    shares = {pair: fmean(overlooked) for pair, overlooked in pairs.items()}
    for (floor, obstacle), share in sorted(shares.items(), key=lambda item: -item[1]):
        if share >= 0.01:
            verdict = "cannot be distinguished" if share > ALIKE else "distinguished"
            count = len(pairs[floor, obstacle])
            yield f"{obstacle} on {floor}: {100 * share:.0f} % of {count} rays overlook it, {verdict}"
    same = {pair for pair, share in shares.items() if share > ALIKE}
    yield f"{len(same)} of {len(shares)} pairs cannot be distinguished"
    for tall, which in ((True, "higher"), (False, "lower")):
        those = [ray for ray in rays if (ray.floor, ray.obstacle) in same and ray.tall is tall]
        ends = 100 * fmean([ray.seen_px is not None for ray in those] or [0])
        goes_on = 100 * fmean([ray.goes_on for ray in those] or [0])
        results = f"{ends:.0f} % end, {goes_on:.0f} % go on above the horizon"
        yield f"of {len(those)} rays to those {which} than the lens {results}"
    others = [ray.goes_on for ray in rays if (ray.floor, ray.obstacle) not in same]
    yield f"of {len(others)} rays to others {100 * fmean(others or [0]):.1f} % go on above the horizon"


def on_rugs(rays: Iterable[Ray]) -> str:
    """Return how often the detected floor ends at a rug in front of the true end, in words."""
    over = [ray for ray in rays if ray.rug_px is not None]
    there = sum(ray.seen_px is not None and abs(ray.seen_px - (ray.rug_px or 0.0)) <= NEAR_PX for ray in over)
    beyond = sum(abs(ray.error_px) <= NEAR_PX for ray in over)
    count = max(1, len(over))
    shares = [f"{100 * number / count:.0f} %" for number in (there, beyond)]
    return f"of {len(over)} rays over a rug {shares[0]} end at its edge, {shares[1]} at what stands behind it"


def main() -> None:
    """Print the tables."""
    arguments = parser(__doc__)
    arguments.add_argument("--rooms", type=int, default=80)
    arguments.add_argument("--places", type=int, default=4, help="to look from, per room")
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--conditions", default=",".join(CONDITIONS), help="with commas")
    args = arguments.parse_args()
    rooms = [make_room(number, args.places, args.seed) for number in range(args.rooms)]
    print("| condition | rays | with a result | median, px | spread, px | right | too far | too near |")
    print("|---" * 8 + "|")
    remarks: list[str] = []
    for name in (each.strip() for each in args.conditions.split(",")):
        condition = CONDITIONS[name]
        rays = [ray for number, room in enumerate(rooms) for ray in measure(room, condition, args.seed + number)]
        print(row(name, rays), flush=True)
        remarks += alike(rays) if condition == CONDITIONS["plain"] else [on_rugs(rays)] if condition.rug else []
    print(*["", *remarks], sep="\n")


if __name__ == "__main__":
    main()
