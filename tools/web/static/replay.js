// The replay of a run: map, chart, lines and decisions move together.

import { Chart } from "./chart.js";
import { FloorMap } from "./map.js";
import { Decisions, Lines } from "./mission.js";
import { Player } from "./player.js";

const find = (id) => document.getElementById(id);
const STEP_MS = 50;
const name = new URLSearchParams(location.search).get("run") ?? "";
const answer = await fetch(`/api/runs/${encodeURIComponent(name)}`);

if (answer.ok) {
  show(await answer.json());
} else {
  find("notice").textContent = await answer.text();
  find("notice").hidden = false;
}

function show(run) {
  const player = new Player(run);
  let playing = 0;
  document.title = `nxtdrive: ${run.mission || run.name}`;
  new FloorMap(player, find("map"));
  new Chart(player, find("chart"));
  new Lines(player, find("lines"));
  new Decisions(player, find("decision"));
  player.on("record", ({ record }) => (find("doing").textContent = `${record.state.replaceAll("_", " ")}: ${record.target}`));
  player.on("time", ({ time }) => {
    find("time").value = time;
    find("clock").textContent = `${time.toFixed(1)} s`;
    if (time >= player.duration) pause();
  });
  find("time").max = player.duration;
  find("time").addEventListener("input", () => player.seek(Number(find("time").value)));
  find("back").addEventListener("click", () => player.jump(-1));
  find("forward").addEventListener("click", () => player.jump(1));
  find("play").addEventListener("click", () => (playing ? pause() : play()));
  player.begin();

  function play() {
    if (player.time >= player.duration) player.seek(0);
    find("play").textContent = "Pause";
    playing = setInterval(() => player.seek(player.time + (STEP_MS / 1000) * Number(find("rate").value)), STEP_MS);
  }

  function pause() {
    clearInterval(playing);
    playing = 0;
    find("play").textContent = "Play";
  }
}
