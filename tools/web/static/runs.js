// The list of runs.

const list = document.getElementById("runs");
const runs = await (await fetch("/api/runs")).json();

if (!runs.length) {
  const notice = document.getElementById("notice");
  notice.textContent = "There are no runs yet. Start a mission on the robot's page, or with `nxtdrive run`.";
  notice.hidden = false;
}
list.replaceChildren(...runs.map(card));

function card({ name, mission, ending, achieved, duration_s, targets, map }) {
  const item = document.createElement("li"), link = document.createElement("a");
  link.href = `replay.html?run=${encodeURIComponent(name)}`;
  if (map) {
    const picture = document.createElement("img");
    picture.src = `/runs/${encodeURIComponent(name)}/map.png`;
    picture.alt = "";
    picture.loading = "lazy";
    link.append(picture);
  }
  const reached = (targets ?? []).filter(({ fate }) => fate === "reached").length;
  const result = `${(ending ?? "unfinished").replaceAll("_", " ")}${duration_s ? ` after ${duration_s.toFixed(0)} s` : ""}`;
  link.append(line("strong", mission || name), line("span", result, achieved ? "good" : "bad"));
  link.append(line("span", `${reached} of ${(targets ?? []).length} targets reached`), line("small", name));
  item.append(link);
  return item;
}

function line(tag, text, style = "") {
  const made = document.createElement(tag);
  made.textContent = text;
  made.className = style;
  return made;
}
