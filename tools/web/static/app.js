// Joins the parts of the page.

import { showCamera } from "./camera.js";
import { Chart } from "./chart.js";
import { Drive } from "./drive.js";
import { FloorMap } from "./map.js";
import { Decisions, Lines, MissionPanel } from "./mission.js";
import "./nav.js";
import { connectRobot, find, notice } from "./page.js";

const connection = connectRobot();
const failed = new Set(); // sensors that the mission does without
let me = "", drives = true, lostLink = "";

showCamera(connection, find("camera"));
new FloorMap(connection, find("map"), { grid: find("layer-grid"), belief: find("layer-belief"), truth: find("layer-truth") });
new Chart(connection, find("chart"));
new Drive(connection, find("pad"), find("knob"));
new MissionPanel(connection, find);
new Lines(connection, find("lines"));
new Decisions(connection, find("decision"));

connection.on("hello", ({ you, address, ...hello }) => {
  me = you;
  drives = hello.drives;
  document.body.classList.toggle("watching", !drives);
  lostLink = "";
  document.title = `nxtdrive ${address}`;
});
for (const change of ["hello", "run", "ended"]) connection.on(change, () => failed.clear());
connection.on("record", ({ record }) => {
  if (record.kind === "sensor") record.answers ? failed.delete(record.sensor) : failed.add(record.sensor);
});
connection.on("closed", forgetMeasurements);
connection.on("ended", ({ ending, duration_s }) => {
  if (drives) return;
  // this was the program's only run: the page stays as it is
  connection.end();
  find("stop").disabled = true;
  find("doing").textContent = `ended: ${ending.replaceAll("_", " ")} after ${(duration_s ?? 0).toFixed(1)} s`;
});
connection.on("link", ({ lost }) => {
  if (lost !== lostLink) notice(lostLink = lost); // it comes with each state, and must not hide other notices
});
connection.on("state", (state) => {
  if (!("battery_mv" in state)) forgetMeasurements(); // the brick cannot be reached
  showState(state);
});
connection.on("status", showState);
connection.on("true_room", () => (find("layer-truth-label").hidden = false));
connection.on("control", ({ driver, asking }) => {
  const mine = driver === me;
  find("control").textContent = !driver ? "Nobody is driving." : mine ? (asking ? `Another page (${asking}) asks for control.` : "You drive.") : `Another page (${driver}) drives.`;
  find("take").hidden = mine || !driver || asking === me;
  find("give").hidden = !mine;
});

find("take").addEventListener("click", () => connection.send({ type: "take_control" }));
find("give").addEventListener("click", () => connection.send({ type: "give_control" }));
find("speed").addEventListener("input", ({ target }) => connection.send({ type: "speed_limit", percent: Number(target.value) }));

function forgetMeasurements() {
  for (const each of ["battery", "range", "bumper", "link"]) find(each).textContent = "–";
}

function showState(state) {
  if (connection.ended) return;
  const lacks = (sensor) => state.lacking?.includes(sensor);
  if (lacks("sonar")) find("range").textContent = "no sonar";
  else if ("range_mm" in state) find("range").textContent = metres(state.range_mm, failed.has("sonar") ? "unknown" : "no echo");
  if ("battery_mv" in state) find("battery").textContent = `${(state.battery_mv / 1000).toFixed(1)} V`;
  const touch = !("touching" in state) ? "–" : state.touching ? "pressed" : "free"; // missions do not tell
  find("bumper").textContent = lacks("bumper") ? "none" : touch;
  find("link").textContent = "latency_ms" in state ? `${state.latency_ms.toFixed(0)} ms` : "–";
  if (!("speed_limit" in state)) return; // a page without the pad
  find("speed").value = state.speed_limit;
  find("speed-shown").textContent = `${state.speed_limit} %`;
}

function metres(mm, none) {
  return mm === null ? none : `${(mm / 1000).toFixed(2)} m`;
}
