// The replay of a run: camera, map, chart, lines and decisions move together.

import { Chart } from "./chart.js";
import { find } from "./dom.js";
import { FloorMap } from "./map.js";
import { Decisions, Lines } from "./mission.js";
import "./nav.js";
import { Player } from "./player.js";
import { RecordedCamera } from "./replay_camera.js";

const STEP_S = 1; // of the arrow keys

try {
  show(await load());
} catch (error) {
  find("doing").textContent = "";
  find("notice").textContent = error.message;
  find("notice").hidden = false;
}

// an exported page has its run in itself
async function load() {
  if (find("run")) return JSON.parse(find("run").textContent);
  const name = new URLSearchParams(location.search).get("run") ?? "";
  const answer = await fetch(`api/runs/${encodeURIComponent(name)}`);
  if (!answer.ok) throw new Error(await answer.text());
  return answer.json();
}

function doing({ kind, state, target, ending, targets }, recoveries) {
  const spaced = (name) => name.replaceAll("_", " ");
  if (kind === "end") return [spaced(ending), ...Object.entries(targets ?? {}).map(([name, how]) => `${name}: ${how === "pending" ? "not reached" : spaced(how)}`)].join("; ");
  return state === "finished" ? state : `${recoveries[state]?.label ?? spaced(state)}: ${target}`;
}

function show(run) {
  const player = new Player(run);
  let playing = 0, last = 0;
  document.title = `nxtdrive: ${run.mission || run.name}`;
  find("camera-panel").hidden = !run.pictures.length;
  if (run.pictures.length) new RecordedCamera(player, find("camera"), run.pictures);
  new FloorMap(player, find("map"));
  new Chart(player, find("chart"));
  new Lines(player, find("lines"));
  new Decisions(player, find("decision"));
  find("what").textContent = `${run.mission || run.name}, profile ${run.profile ?? "not known"}`;
  player.on("record", ({ record }) => {
    find("doing").textContent = doing(record, run.recoveries);
  });
  player.on("time", ({ time }) => {
    find("time").value = time;
    find("clock").textContent = `${time.toFixed(1)} of ${player.duration.toFixed(1)} s`;
    if (time >= player.duration) pause();
  });
  find("time").max = Math.ceil(player.duration * 10) / 10; // whole steps: else its end would be before that of the run
  find("decisions").replaceChildren(...player.decisions.map((t) => new Option("", t.toFixed(1))));
  find("time").addEventListener("input", () => player.seek(Number(find("time").value)));
  find("back").addEventListener("click", () => player.jump(-1));
  find("forward").addEventListener("click", () => player.jump(1));
  find("play").addEventListener("click", toggle);
  addEventListener("keydown", (event) => {
    const held = event.target.closest("button, select") ? " " : "";
    const key = event.key.length > 1 ? event.key : event.key.toLowerCase(); // J with caps lock
    if (event.ctrlKey || event.altKey || event.metaKey || key === held || !(key in keys)) return;
    if (event.target.closest("select, #lines") && key.length > 1) return; // arrows move in them
    event.preventDefault();
    keys[key]();
  });
  player.begin();

  const keys = {
    " ": toggle,
    ArrowLeft: () => player.seek(player.time - STEP_S),
    ArrowRight: () => player.seek(player.time + STEP_S),
    Home: () => player.seek(0),
    End: () => player.seek(player.duration),
    j: () => player.jump(1),
    k: () => player.jump(-1),
  };

  function toggle() {
    if (playing) return pause();
    if (player.time >= player.duration) player.seek(0);
    find("play").textContent = "Pause";
    last = performance.now();
    playing = requestAnimationFrame(step);
  }

  function step(now) {
    playing = requestAnimationFrame(step);
    const passed = (Math.max(0, now - last) / 1000) * Number(find("rate").value);
    last = now;
    if (passed) player.seek(player.time + passed);
  }

  function pause() {
    cancelAnimationFrame(playing);
    playing = 0;
    find("play").textContent = "Play";
  }
}
