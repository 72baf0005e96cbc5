// The editor of missions: opens, checks while one types, saves.

import { element } from "./dom.js";
import "./nav.js";
import { ask, connectRobot, find, notice } from "./page.js";
import { Photograph } from "./photograph.js";

const CHECK_AFTER_MS = 300;
const NEW = "new.toml";
let opened = { name: "", version: "", text: "" }, checks = 0, waiting = 0;

connectRobot();
new Photograph(find, {
  // in place of the untouched template a new mission is made of the target
  text: () => (!opened.version && find("text").value === opened.text ? "" : find("text").value),
  show: (text) => setText(text),
  notice,
});
find("file").addEventListener("change", () => mayLeave() && open(find("file").value));
find("text").addEventListener("input", changed);
find("file-form").addEventListener("submit", (event) => {
  event.preventDefault();
  save();
});
find("text").addEventListener("keydown", (event) => {
  if (event.key === "s" && (event.ctrlKey || event.metaKey)) {
    event.preventDefault();
    find("file-form").requestSubmit();
  }
});
addEventListener("beforeunload", (event) => find("text").value !== opened.text && event.preventDefault());

await list();
await open(new URLSearchParams(location.search).get("mission") ?? "");

async function list() {
  const answer = await ask("api/missions");
  if (!answer.ok) return notice(await answer.text());
  const names = await answer.json();
  find("file").replaceChildren(new Option("a new mission", ""), ...names.map((name) => new Option(name, name)));
}

async function open(name) {
  notice("");
  const answer = await ask(name ? `api/missions/${encodeURIComponent(name)}` : "api/template");
  if (!answer.ok) return notice(await answer.text());
  opened = name ? { name, ...(await answer.json()) } : { name, version: "", text: await answer.text() };
  find("file").value = name;
  find("name").value = name || freeName();
  find("text").value = opened.text;
  opened.text = find("text").value; // with the line ends of a text area
  changed();
}

async function save() {
  const name = find("name").value, text = find("text").value;
  const version = name === opened.name ? opened.version : "";
  const body = JSON.stringify({ text, version });
  const answer = await ask(`api/missions/${encodeURIComponent(name)}`, { method: "PUT", body });
  if (!answer.ok) return notice(await answer.text());
  opened = { name, text, ...(await answer.json()) };
  notice("");
  await list();
  find("file").value = name;
  changed();
}

function setText(text) {
  find("text").value = text;
  changed();
}

function unsaved() {
  return find("text").value !== opened.text || !opened.version;
}

function changed() {
  find("saved").textContent = unsaved() ? "not saved" : "saved";
  clearTimeout(waiting);
  waiting = setTimeout(check, CHECK_AFTER_MS);
}

// an answer that comes after that to a later text is dropped
async function check() {
  const number = ++checks;
  const answer = await ask("api/check", { method: "POST", body: JSON.stringify({ text: find("text").value }) });
  if (number !== checks) return;
  if (!answer.ok) return notice(await answer.text());
  const { mistakes, warnings } = await answer.json();
  const count = mistakes.length === 1 ? "1 mistake" : `${mistakes.length} mistakes`;
  find("verdict").textContent = mistakes.length ? count : `No mistakes. ${unsaved() ? "Save it to start it." : "Start it on the robot's page."}`;
  find("verdict").className = mistakes.length ? "bad" : "good";
  find("mistakes").replaceChildren(...[...mistakes, ...warnings.map((each) => `warning: ${each}`)].map((text) => element("li", text)));
}

function mayLeave() {
  const may = find("text").value === opened.text || confirm("Leave without saving?");
  if (!may) find("file").value = opened.name;
  return may;
}

function freeName() {
  const names = [...find("file").options].map(({ value }) => value);
  let name = NEW;
  for (let number = 2; names.includes(name); number++) name = `new-${number}.toml`;
  return name;
}
