// The page of a classroom: a tile for each robot, missions for those that are chosen, and the stop of all.

import { choices } from "./mission.js";
import { connect, find } from "./page.js";
import { Results } from "./results.js";
import { Tile } from "./tile.js";

const TILE_PICTURE = 4;
const OWN = "own";
const connection = connect("stop_all", find("summary"));
const results = new Results(find);
let tiles = [], ended = "";
const seen = new Set();
const inSight = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) isIntersecting ? seen.add(target.dataset.name) : seen.delete(target.dataset.name);
  tellVisible();
});

connection.on("hello", ({ name, robots, missions, profiles }) => {
  document.title = `nxtdrive: ${name}`;
  find("title").textContent = name;
  offer(missions, profiles, robots.some(({ mission }) => mission));
  if (robots.map((robot) => robot.name).join("\n") !== tiles.map((tile) => tile.name).join("\n")) build(robots);
  tellVisible();
  results.fetch();
});
connection.on("robots", ({ robots }) => {
  robots.forEach((robot, number) => tiles[number].show(robot));
  choose();
  const count = (test) => robots.filter(test).length;
  const stopped = count((robot) => robot.stopped);
  const parts = [`${count(({ open }) => open)} of ${robots.length} open`, `${count(({ running }) => running)} on a mission`];
  find("summary").textContent = [...parts, ...(stopped ? [`${stopped} stopped`] : [])].join(", ");
  find("release").hidden = !stopped;
  const now = robots.map((robot) => robot.ended).join(" ");
  if (ended && now !== ended) results.fetch();
  ended = now;
});
connection.on(`image ${TILE_PICTURE}`, ({ number, bitmap }) => tiles[number].picture(bitmap));

find("stop").addEventListener("click", () => connection.send({ type: "stop_all" }));
find("release").addEventListener("click", () => connection.send({ type: "release_all" }));
find("all").addEventListener("change", ({ target }) => {
  for (const tile of tiles) tile.chosen = target.checked;
  choose();
});
find("hand-out").addEventListener("submit", (event) => {
  event.preventDefault();
  const mission = find("mission").value;
  connection.send({ type: "start", robots: names(free()), mission: mission === OWN ? null : mission, profile: find("profile").value || null });
});
find("end").addEventListener("click", () => connection.send({ type: "end", robots: names(chosen()) }));
addEventListener("visibilitychange", tellVisible);

function build(robots) {
  for (const tile of tiles) inSight.unobserve(tile.element);
  seen.clear();
  tiles = robots.map((robot) => new Tile(robot, connection, choose));
  find("robots").replaceChildren(...tiles.map(({ element }) => element));
  for (const tile of tiles) inSight.observe(tile.element);
  choose();
}

function offer(missions, profiles, own) {
  const options = [...(own ? [[OWN, "each robot's own"]] : []), ["", "lena, then rilakkuma (built in)"], ...missions.map((name) => [name, name])];
  choices(find("mission"), options);
  choices(find("profile"), [["", "as the mission says"], ...profiles.map((name) => [name, name])]);
}

function chosen() {
  return tiles.filter((tile) => tile.chosen);
}

function free() {
  return chosen().filter((tile) => !tile.running);
}

function names(some) {
  return some.map((tile) => tile.name);
}

function choose() {
  const number = chosen().length, startable = free().length;
  find("start").textContent = startable ? `Start on ${startable}` : "Start";
  find("start").disabled = !startable;
  find("end").disabled = !number;
  find("none-free").hidden = startable > 0;
  find("none-free").textContent = number ? "All ticked robots are on a mission." : "Tick robots first.";
  find("all").checked = number > 0 && number === tiles.length;
  find("all").indeterminate = number > 0 && number < tiles.length;
}

function tellVisible() {
  connection.send({ type: "visible", robots: document.hidden ? [] : [...seen] });
}
