// The page of calibrations: start, progress, questions, what was found, save.

import { showCamera } from "./camera.js";
import { element } from "./dom.js";
import "./nav.js";
import { brief, connectRobot, find } from "./page.js";

const connection = connectRobot();
let question = 0, lacksSheet = false, running = false;

showCamera(connection, find("camera"));
connection.on("hello", ({ address }) => {
  lacksSheet = address.startsWith("sim:") && !address.startsWith("sim://calibration");
  choose();
  block(false);
});
connection.on("run", () => block(true));
connection.on("ended", () => block(false));
connection.on("calibration", (state) => {
  running = state.running;
  find("file").textContent = state.file;
  find("known").textContent = `(${state.known})`;
  find("start").hidden = running;
  find("end").hidden = !running;
  for (const each of find("start-form").querySelectorAll("input")) each.disabled = running;
  choose();
  find("lines").replaceChildren(...state.lines.map((text) => element("li", text)));
  find("lines").scrollTop = find("lines").scrollHeight;
  ask(state.question);
  find("problem").textContent = state.problem;
  find("problem").hidden = !state.problem;
  show(state);
});

for (const each of document.querySelectorAll("[name=how]")) each.addEventListener("change", choose);
find("start-form").addEventListener("submit", (event) => {
  event.preventDefault();
  const what = [...document.querySelectorAll("[name=what]:checked")].map((each) => each.value);
  if (how() === "sheet" && !what.length) return brief("Choose what to calibrate.");
  find("free").checked = false; // the next one asks again
  const more = { sheet: { what, sheet_height_mm: Number(find("height").value) }, ruler: {}, color: { color: find("color").value || null } };
  connection.send({ type: "start_calibration", how: how(), ...more[how()] });
});
find("ask-form").addEventListener("submit", (event) => {
  event.preventDefault();
  connection.send({ type: "answer_calibration", question, value: Number(find("answer").value) });
});
find("end").addEventListener("click", () => connection.send({ type: "stop_mission" }));
find("save").addEventListener("click", () => connection.send({ type: "save_calibration" }));

function block(is) {
  find("start").disabled = is;
  find("busy").hidden = !is;
}

function how() {
  return document.querySelector("[name=how]:checked").value;
}

function choose() {
  const sheet = how() === "sheet", color = how() === "color";
  find("sheet-steps").hidden = find("what").hidden = find("height-label").hidden = !sheet;
  find("no-sheet").hidden = !sheet || !lacksSheet;
  find("color-label").hidden = find("color-hint").hidden = !color;
  find("free-label").hidden = color;
  find("height").disabled = running || !sheet;
  find("free").disabled = running || color;
  find("color").disabled = running;
}

function ask(open) {
  find("ask-form").hidden = !open;
  if (!open) question = 0;
  if (!open || open.question === question) return;
  question = open.question;
  find("question-text").textContent = open.text;
  find("answer").hidden = !open.number;
  find("answer").value = 0;
  (open.number ? find("answer") : find("ask-form").querySelector("button")).focus();
}

function show({ values, misfit_px, remark, views, saved, file, running: busy }) {
  find("found").hidden = busy || !values.length;
  find("values").replaceChildren(...values.map(row));
  const frames = misfit_px && `Markers were missed by ${misfit_px[0].toFixed(1)} px before, and by ${misfit_px[1].toFixed(1)} px now (${views} frames).`;
  find("misfit").textContent = [remark, frames].filter(Boolean).join(" ");
  find("save").hidden = saved;
  find("saved").textContent = saved ? `Saved to ${file}; missions started here use it from now on.` : "";
}

function row({ key, before, after, standard_error }) {
  const made = document.createElement("tr");
  const unsure = standard_error === null ? "" : String(Number(standard_error.toPrecision(2)));
  made.append(element("th", key), ...[short(before), short(after), unsure].map((each) => element("td", each)));
  made.firstChild.scope = "row";
  return made;
}

function short(value) {
  if (value === null) return ""; // it was not known
  return typeof value === "number" ? String(Number(value.toPrecision(Math.abs(value) < 1 ? 2 : 6))) : String(value);
}
