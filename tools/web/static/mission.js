// Missions: start, end, the lines of what the robot does, questions, and why the last decision was made.

export class Lines {
  constructor(connection, list) {
    this.list = list;
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
    const list = this.list;
    const atEnd = list.scrollHeight - list.scrollTop - list.clientHeight < 40;
    list.append(element("li", text));
    if (atEnd) list.scrollTop = list.scrollHeight;
  }
}

export class Decisions {
  constructor(connection, box) {
    this.box = box;
    connection.on("run", () => box.replaceChildren());
    connection.on("record", ({ record }) => record.kind === "choice" && this.show(record));
  }

  show({ choice, why, evidence }) {
    const rows = Object.entries(evidence ?? {}).filter(([, value]) => ["string", "number", "boolean"].includes(typeof value));
    const table = document.createElement("table");
    for (const [name, value] of rows) {
      const row = table.insertRow();
      row.append(element("th", name.replaceAll("_", " ")), element("td", String(value).replaceAll("_", " ")));
    }
    this.box.replaceChildren(element("h2", `last decision: ${choice.replaceAll("_", " ")}, since ${why}`), table);
  }
}

export class MissionPanel {
  constructor(connection, find) {
    this.connection = connection;
    this.find = find;
    connection.on("hello", ({ missions }) => this.offer(missions));
    connection.on("run", () => this.running(true));
    connection.on("ended", () => this.running(false));
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

  offer(missions) {
    const options = [["", "lena, then rilakkuma (built in)"], ...missions.map((name) => [name, name])];
    this.find("mission").replaceChildren(...options.map(([value, text]) => new Option(text, value)));
    this.running(false);
    this.find("question").hidden = true;
  }

  running(is) {
    this.find("start").hidden = is;
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
    const buttons = candidates.map(({ text, why, seconds, chance }, choice) => {
      const numbers = chance === undefined ? "" : ` (${seconds.toFixed(0)} s, chance ${(chance * 100).toFixed(0)} %)`;
      const button = element("button", `${text}${numbers}${choice ? "" : `: proposed, since ${why}`}`);
      button.type = "button";
      button.addEventListener("click", () => this.connection.send({ type: "answer", question: number, choice }));
      return button;
    });
    this.find("question-choices").replaceChildren(...buttons);
    buttons[0].focus();
  }
}

function element(name, text) {
  const made = document.createElement(name);
  made.textContent = text;
  return made;
}
