// What pages have in common: the notice, the connection to the server, and STOP.

import { Connection } from "./connection.js";
import { find } from "./dom.js";

const NOTICE_MS = 8000;
const CLICKED = "button, input[type=checkbox], input[type=radio]", CHANGED = "select, input[type=range]";
let lasting = "", hides = 0, byPointer = false;

export { find };

// stays until the next one; with a time it then gives way to the last one that stays
export function notice(text, forMs = 0) {
  clearTimeout(hides);
  if (!forMs) lasting = text;
  find("notice").textContent = text;
  find("notice").hidden = !text;
  if (forMs) hides = setTimeout(() => notice(lasting), forMs);
}

// what the server answers; without a server an answer that says so
export function ask(url, options) {
  return fetch(url, options).catch(() => new Response("nxtdrive does not answer. Is it still running?", { status: 503 }));
}

export const brief = (text) => notice(text, NOTICE_MS);

// Args: the message that Space sends, and the element that says what the robot does
export function connect(stop, doing) {
  const connection = new Connection();
  let lost = false;
  connection.on("hello", () => {
    if (lost) notice("");
    lost = false;
  });
  connection.on("closed", () => {
    lost = true;
    doing.textContent = "no connection to nxtdrive";
    notice("Connection to nxtdrive lost; retrying every second. STOP takes effect when it is back.");
  });
  for (const type of ["refused", "problem"]) connection.on(type, ({ text }) => brief(text));
  addEventListener("keydown", (event) => {
    if (event.code === "Space" && !event.target.closest("input, select, textarea, button")) {
      event.preventDefault();
      connection.send({ type: stop });
    }
  });
  return connection;
}

// a page of one robot: says what it does; its button stops and releases it
export function connectRobot() {
  const connection = connect("stop", find("doing"));
  let stopped = false;
  const show = (state) => {
    if (connection.ended) return; // it comes after the event that has ended the program's only run
    find("doing").textContent = state.doing;
    if (!("stopped" in state)) return; // a run of another program, which cannot be released
    stopped = state.stopped;
    find("stop").textContent = stopped ? "release" : "STOP";
    find("stop").classList.toggle("released", stopped);
  };
  for (const type of ["state", "status"]) connection.on(type, show);
  find("stop").addEventListener("click", () => connection.send({ type: stopped ? "release" : "stop" }));
  return connection;
}

// A control keeps the focus after a click, and would take Space for itself, and arrows; one reached by Tab keeps it.
function releaseFocus(controls) {
  if (byPointer && document.activeElement.matches(controls)) document.activeElement.blur();
}

addEventListener("pointerdown", () => (byPointer = true), true);
addEventListener("keydown", () => (byPointer = false), true);
addEventListener("click", () => releaseFocus(CLICKED));
addEventListener("change", () => releaseFocus(CHANGED));
