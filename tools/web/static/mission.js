// Missions: start, end, the lines of what the robot does, questions, and why the last decision was made.

import { element } from "./dom.js";

const SECONDS_SHOWN = 10000; // an expected time beyond this is shown as "never", as in the terminal

export class Lines {
  constructor(connection, list) {
    this.list = list;
    this.follows = true; // until a reader scrolls up; also when the list gets smaller, as at the end of a mission
    list.addEventListener("scroll", () => { this.follows = list.scrollHeight - list.scrollTop - list.clientHeight < 40; });
    new ResizeObserver(() => this.follow()).observe(list);
    connection.on("hello", () => list.replaceChildren()); // what is known comes again
    connection.on("run", ({ name }) => {
      list.replaceChildren();
      if (name) this.add(`mission: ${name}`);
    });
    connection.on("line", ({ text }) => this.add(text));
    connection.on("problem", ({ text }) => this.add(`! ${text}`));
    connection.on("ended", ({ ending, duration_s, folder }) => {
      this.add(`${ending.replaceAll("_", " ")} after ${(duration_s ?? 0).toFixed(1)} s; kept in ${folder}`);
    });
  }

  add(text) {
    this.list.append(element("li", text, text.startsWith(" ") ? "timed" : ""));
    this.follow();
  }

  follow() {
    if (this.follows) this.list.scrollTop = this.list.scrollHeight;
  }
}

export class Decisions {
  constructor(connection, box) {
    this.box = box;
    for (const begin of ["hello", "run"]) connection.on(begin, () => this.clear());
    connection.on("decision", (decision) => this.show(decision));
    this.clear();
  }

  clear() {
    this.box.replaceChildren(
      element("h2", "Decisions"),
      element("p", "None yet. When an attempt fails, this says why, what could be done, and what the robot chooses.", "hint"),
    );
  }

  show({ t, target, failed, known, choice, why, operator, candidates, chosen, what_if }) {
    const parts = [
      element("h2", `Decision at ${t.toFixed(1)} s`),
      element("p", `${target}: ${failed}`),
      element("p", `→ ${choice}: ${why}${operator ? " (you decided)" : ""}`, "choice"),
    ];
    if (candidates.length) parts.push(this.table(candidates, chosen));
    if (what_if) parts.push(element("p", `What if: ${what_if}`));
    const list = document.createElement("ul");
    list.append(...known.map((text) => element("li", text)));
    this.box.replaceChildren(...parts, list);
    this.box.scrollTop = 0;
  }

  table(candidates, chosen) {
    const table = document.createElement("table");
    table.createCaption().textContent = "What could be done";
    const head = table.createTHead().insertRow();
    const played = candidates.some(({ cost_s }) => cost_s);
    const titles = ["candidate", "costs", "chance", "per success", ...(played ? ["what if"] : [])];
    for (const title of titles) head.append(element("th", title));
    const body = table.createTBody();
    candidates.forEach((each, index) => {
      const row = body.insertRow();
      const cells = [`${index === chosen ? "chosen: " : ""}${each.text}`, seconds(each.seconds), chance(each.chance), seconds(each.expected_s)];
      if (played) cells.push(cost(each));
      row.append(...cells.map((text) => element("td", text)));
      row.title = each.why;
      if (index !== chosen) return;
      row.className = "chosen";
      body.prepend(row);
    });
    return table;
  }
}

export class MissionPanel {
  constructor(connection, find) {
    this.connection = connection;
    this.find = find;
    connection.on("hello", ({ missions, profiles, proposed }) => this.offer(missions, profiles, proposed));
    connection.on("run", ({ name, profile }) => this.running(`${name || "a mission"}, profile ${profile}`));
    connection.on("ended", () => this.running(""));
    connection.on("question", (question) => this.ask(question));
    find("mission-form").addEventListener("submit", (event) => {
      event.preventDefault();
      const profile = find("profile").value || null;
      connection.send({ type: "start_mission", mission: find("mission").value, profile, confirm: find("confirm").checked });
    });
    connection.on("paused", ({ paused }) => this.pause(paused));
    find("end").addEventListener("click", () => connection.send({ type: "stop_mission" }));
    find("pause").addEventListener("click", () => connection.send({ type: this.paused ? "resume" : "pause" }));
  }

  offer(missions, profiles, proposed) {
    const options = [["", "lena, then rilakkuma (built in)"], ...missions.map((name) => [name, name])];
    choices(this.find("mission"), options, proposed);
    choices(this.find("profile"), [["", "as the mission says"], ...profiles.map((name) => [name, name])]);
    this.running("");
    this.pause(false);
    this.find("question").hidden = true;
  }

  // what runs, in words; empty for nothing
  running(what) {
    const is = Boolean(what);
    this.find("running").textContent = what;
    this.find("start").hidden = is;
    for (const id of ["mission", "profile", "confirm"]) this.find(id).disabled = is;
    this.find("end").hidden = this.find("pause").hidden = !is;
  }

  pause(is) {
    this.paused = is;
    this.find("pause").textContent = is ? "Resume" : "Pause";
    this.find("pause").classList.toggle("paused", is);
  }

  ask({ open, number, target, failed, known, candidates }) {
    const box = this.find("question");
    box.hidden = !open;
    if (!open) return;
    this.find("question-title").textContent = `${target}: ${failed}. What now?`;
    this.find("question-known").replaceChildren(...known.map((text) => element("li", text)));
    const buttons = candidates.map((each, choice) => {
      const numbers = each.chance === undefined ? "" : ` (${seconds(each.seconds)}, chance ${chance(each.chance)})`;
      const button = element("button", `${each.text}${numbers}${choice ? "" : `, proposed: ${each.why}`}`);
      button.type = "button";
      button.addEventListener("click", () => this.connection.send({ type: "answer", question: number, choice }));
      return button;
    });
    this.find("question-choices").replaceChildren(...buttons);
    box.focus(); // not a button: Space stops
  }
}

// options of a select, each a value and its text; a choice that is still among them stays, the first one is proposed
export function choices(select, options, proposed = options[0][0]) {
  const value = select.length ? select.value : proposed;
  select.replaceChildren(...options.map(([each, text]) => new Option(text, each)));
  if (options.some(([each]) => each === value)) select.value = value;
}

function seconds(value) {
  if (value === undefined) return "–";
  return value === null || value > SECONDS_SHOWN ? "never" : `${value.toFixed(0)} s`;
}

// mean time to the targets that were left, as nxtdrive what-if found it
function cost({ cost_s, best }) {
  return cost_s ? `${seconds(cost_s[0])}${best ? " best" : ""}` : "–";
}

function chance(value) {
  return value === undefined ? "–" : `${(value * 100).toFixed(0)} %`;
}
