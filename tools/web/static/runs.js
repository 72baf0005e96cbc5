// The list of runs.

import { element } from "./dom.js";
import "./nav.js";
import { ask, connectRobot, find, notice } from "./page.js";

connectRobot();
const answer = await ask("api/runs");

if (answer.ok) {
  const runs = await answer.json();
  find("runs").replaceChildren(...runs.map(card));
  if (!runs.length) notice("There are no runs yet. Start a mission on the robot's page, or with `nxtdrive run`.");
} else notice(await answer.text());

function card({ name, mission, ending, achieved, duration_s, targets, map }) {
  const item = document.createElement("li"), link = document.createElement("a");
  link.href = `replay.html?run=${encodeURIComponent(name)}`;
  if (map) {
    const picture = document.createElement("img");
    picture.src = `runs/${encodeURIComponent(name)}/map.png`;
    picture.alt = "";
    picture.loading = "lazy";
    link.append(picture);
  }
  const running = ending === "running", since = running ? "for" : "after";
  const result = `${ending.replaceAll("_", " ")}${duration_s === null ? "" : ` ${since} ${length(duration_s)}`}`;
  link.append(element("strong", mission || name), element("span", result, running ? "" : achieved ? "good" : "bad"));
  const reached = targets.filter(({ outcome }) => outcome === "reached").length;
  if (targets.length) link.append(element("span", `${reached} of ${targets.length} targets reached`));
  link.append(element("small", name));
  item.append(link);
  return item;
}

function length(seconds) {
  return seconds < 60 ? `${seconds.toFixed(0)} s` : `${Math.floor(seconds / 60)} min ${Math.floor(seconds % 60)} s`;
}
