"""Load a world file and report all of its mistakes at once."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from firmware_protocol.errors import ConfigError
from input_files.mistakes import hint, is_foreign, nearest
from input_files.plain import InputFileError, missing_file
from sim_backend.bundled import WORLDS, picture_names, world_names
from sim_backend.toml_file import check, mistakes, read_tables
from sim_backend.world.event_tables import Event
from sim_backend.world.partial_world import PartialWorld, valid_part
from sim_backend.world.placement import misplaced
from sim_backend.world.toml_types import TEXTURES
from sim_backend.world.world_file import Box, Person, Wall, WorldFile

OWN_FAULTS = {"no_echo": "ultrasonic", "pressed": "touch"}
"""Faults of one kind of sensor only."""


def load_world(source: str | Path, *, read_images: bool = False) -> WorldFile:
    """Load the world in a file.

    Args:
        source: Path of a TOML file, or the name of a bundled world, without ".toml".
        read_images: Whether to read all image files as well, so that an unreadable one is among the mistakes.

    Raises:
        ConfigError: There is no such file, or it has mistakes; the message lists all of them.
    """
    path = _find(Path(source))
    tables = read_tables(path)
    if "mission" in tables and "floor" not in tables:
        raise ConfigError(f"{path} is a mission, not a world.", remedy="`nxtdrive world new FILE` writes a world.")
    if is_foreign(tables, WorldFile.model_fields):
        raise ConfigError(
            f"{path} is not a world: it has no [floor] and no [robot].", remedy="`nxtdrive world new FILE` writes one."
        )
    return parse_world(tables, path, read_images=read_images)


def parse_world(tables: Mapping[str, Any], path: Path, *, read_images: bool = False) -> WorldFile:
    """Validate the parsed tables of a TOML file as a world.

    Args:
        tables: The tables as `tomllib` returns them.
        path: The file, for messages and to find pictures beside it.
        read_images: As in `load_world`.

    Raises:
        ConfigError: The tables have mistakes; the message lists all of them.
    """
    world, problems = check(WorldFile, tables)
    found = [problem.sentence for problem in problems]
    part = PartialWorld(world, {}, {}) if world else valid_part(tables, problems)
    if part:
        sentences = list(_mistakes(part.world, path.parent, part.lost))
        sentences += _unreadable_images(part.world, path.parent) if read_images else []
        found += map(part.renumbered, part.relevant(sentences))
    if found or world is None:
        raise mistakes(path, found)
    return _with_image_paths(world, path.parent)


def image_files(world: WorldFile) -> list[Path]:
    """Return the image files that a loaded world names."""
    textures = (Path(name) for _, name in _textures(world))
    return [*filter(_is_image_file, textures), *(each.file for each in world.pictures if each.file is not None)]


def _mistakes(world: WorldFile, folder: Path, lost: Mapping[str, list[str]]) -> Iterator[str]:
    """Yield mistakes in how tables fit together.

    Args:
        world: The world.
        folder: Where its images lie.
        lost: Names of objects and events, by table, that are in the file and have mistakes of their own.
    """
    yield from _wrong_names(world, lost)
    yield from _wrong_ports(world)
    yield from _wrong_faults(world)
    yield from _wrong_places(world)
    yield from misplaced(world)
    yield from _missing_images(world, folder)
    yield from _missing_textures(world, folder)


def _find(path: Path) -> Path:
    candidates = [path]
    if path.parent == Path():
        # a file without a suffix hides no bundled world: other files are called "open" or "track", too
        candidates = [WORLDS / f"{path}.toml", path]
    for candidate in candidates:
        if os.path.isfile(candidate):
            return candidate
    if os.path.isdir(path):
        raise ConfigError(f"{path} is a folder, not a world.", remedy="Choose a file in it.")
    bundled = world_names()
    known = {name: name for name in bundled} if path.parent == Path() else {}
    known |= {entry.stem: str(entry) for entry in path.parent.glob("*.toml")}
    near = known.get(nearest(path.stem, known))
    remedy = f"Did you mean {near!r}?" if near else f"Give a path, or one of: {', '.join(bundled)}."
    raise ConfigError(f"there is no world file {path}.", remedy=remedy)


def _wrong_names(world: WorldFile, lost: Mapping[str, list[str]]) -> Iterator[str]:
    tables = ("boxes", "people", "pictures", "events")
    names: dict[str, list[str]] = {table: [each.name for each in getattr(world, table)] for table in tables}
    taken: set[str] = set()
    for table, own in names.items():
        for index, name in enumerate(own):
            # boxes, people and pictures share one namespace; an event may have the name of one of them
            if name in (own[:index] if table == "events" else taken):
                yield f"{table}[{index}].name: {name!r} is taken already"
            taken.add(name)
    known = {table: [*own, *lost.get(table, [])] for table, own in names.items()}
    for index, event in enumerate(world.events):
        yield from _unknown_names(f"events[{index}]", event, known)


def _unknown_names(path: str, event: Event, names: Mapping[str, list[str]]) -> Iterator[str]:
    references: dict[str, tuple[str | None, tuple[str, ...]]] = {
        "person": (event.person, ("people",)),
        "box": (event.box, ("boxes",)),
        "picture": (event.picture, ("pictures",)),
        "blocks": (event.blocks, ("pictures",)),
        "when.sees": (event.when.sees, ("pictures",)),
        "when.of": (event.when.of, ("boxes", "people", "pictures")),
        "when.after": (event.when.after, ("events",)),
        "when.after_end_of": (event.when.after_end_of, ("events",)),
    }
    for key, (name, tables) in references.items():
        known = [each for table in tables for each in names[table]]
        if name is not None and name not in known:
            advice = hint(name, known) if known else f"describe it in a table [[{']] or [['.join(tables)}]]"
            yield f"{path}.{key}: there is no {name!r}; {advice}"


def _wrong_ports(world: WorldFile) -> Iterator[str]:
    robot = world.robot
    taken = {robot.touch_port: "robot.touch_port", robot.ultrasonic_port: "robot.ultrasonic_port"}
    wanted = {sensor.port for sensor in world.sensors}
    for index, sensor in enumerate(world.sensors):
        path = f"sensors[{index}].port"
        holder = taken.setdefault(sensor.port, path)
        if holder != path:
            free = ", ".join(str(port) for port in range(1, 5) if port not in {*taken, *wanted})
            remedy = f"take another one (free: {free or 'none'})"
            remedy += f" or set {holder} to 0" if holder.startswith("robot") else ""
            yield f"{path}: {holder} has port {sensor.port} already; {remedy}"


def _wrong_faults(world: WorldFile) -> Iterator[str]:
    robot = world.robot
    kinds = {sensor.port: sensor.kind for sensor in world.sensors}
    kinds |= {robot.touch_port: "touch", robot.ultrasonic_port: "ultrasonic"}
    for index, event in enumerate(world.events):
        if event.sensor is None:
            continue
        kind, path = kinds.get(event.sensor), f"events[{index}]"
        if kind is None:
            ports = ", ".join(str(port) for port in sorted(kinds) if port) or "none"
            yield f"{path}.sensor: there is no sensor at port {event.sensor}; name another one (there are: {ports})"
        elif (own := OWN_FAULTS.get(event.fault or "", kind)) != kind:
            yield (
                f"{path}.fault: {event.fault} is for {own} sensors; at port {event.sensor} is a {kind} sensor; "
                "take stuck, error or unplugged"
            )
        elif kind == "color":
            yield f"{path}.sensor: a colour sensor cannot fail yet; name another one"


def _wrong_places(world: WorldFile) -> Iterator[str]:
    places = [("robot.start_mm", world.robot.start_mm)]
    places += [(f"boxes[{index}].at_mm", box.at_mm) for index, box in enumerate(world.boxes)]
    places += [(f"pictures[{index}].at_mm", picture.at_mm) for index, picture in enumerate(world.pictures)]
    places += [(f"people[{index}].enters_from_mm", person.enters_from_mm) for index, person in enumerate(world.people)]
    places += [(f"sounds[{index}].at_mm", sound.at_mm) for index, sound in enumerate(world.sounds)]
    places += [(f"events[{index}].to_mm", event.to_mm) for index, event in enumerate(world.events) if event.to_mm]
    width, depth = world.floor.size_mm
    for key, (x, y) in places:
        if not (0 <= x <= width and 0 <= y <= depth):
            yield f"{key}: ({x:g}, {y:g}) is outside the floor of {width:g} x {depth:g} mm"


def _missing_images(world: WorldFile, folder: Path) -> Iterator[str]:
    known = picture_names()
    for index, picture in enumerate(world.pictures):
        if picture.file is None and picture.name not in known:
            yield f"pictures[{index}].name: no picture {picture.name!r} here ({', '.join(known)}); give its file"
        elif picture.file is not None and not os.path.isfile(folder / picture.file):
            yield f"pictures[{index}].file: there is no file {missing_file(str(picture.file), folder, 'world')}"


def _missing_textures(world: WorldFile, folder: Path) -> Iterator[str]:
    known = [*TEXTURES, *picture_names()]
    for path, name in _textures(world):
        if name not in known and not _is_image_file(folder / name):
            yield f"{path}: there is no texture {name!r}; {hint(name, known)}"


def _textures(world: WorldFile) -> Iterator[tuple[str, str]]:
    """Yield the path of each key that names a texture, and the texture."""
    yield "floor.wall_texture", world.floor.wall_texture
    tables: dict[str, Sequence[Wall | Box | Person]]
    tables = {"walls": world.walls, "boxes": world.boxes, "people": world.people}
    for table, entries in tables.items():
        for index, entry in enumerate(entries):
            yield f"{table}[{index}].texture", entry.texture


def _is_image_file(texture: Path) -> bool:
    return bool(texture.suffix) and os.path.isfile(texture)


def _unreadable_images(world: WorldFile, folder: Path) -> Iterator[str]:
    """Yield mistakes in image files that exist."""
    from input_files.picture import read_picture

    files = [(path, folder / name) for path, name in _textures(world) if _is_image_file(folder / name)]
    for index, picture in enumerate(world.pictures):
        if picture.file is not None and os.path.isfile(folder / picture.file):
            files.append((f"pictures[{index}].file", folder / picture.file))
    for path, file in files:
        try:
            read_picture(file)
        except InputFileError as error:
            yield f"{path}: {error}"


def _with_image_paths(world: WorldFile, folder: Path) -> WorldFile:
    changed: dict[str, Any] = {
        "floor": world.floor.model_copy(update={"wall_texture": _texture(world.floor.wall_texture, folder)}),
        "pictures": tuple(
            picture if picture.file is None else picture.model_copy(update={"file": folder / picture.file})
            for picture in world.pictures
        ),
    }
    for table in ("walls", "boxes", "people"):
        entries = getattr(world, table)
        changed[table] = tuple(each.model_copy(update={"texture": _texture(each.texture, folder)}) for each in entries)
    return world.model_copy(update=changed)


def _texture(name: str, folder: Path) -> str:
    """Return the path of a texture that is an image file, the name of any other."""
    return str(folder / name) if _is_image_file(folder / name) else name
