// The statechart as nested boxes, drawn from the server's description, so that new states appear by themselves, and
// the last transitions.

const TRANSITIONS = 6;

export class Chart {
  constructor(connection, element) {
    this.element = element;
    this.hint = element.parentElement.querySelector(".hint");
    this.boxes = new Map();
    this.parents = new Map();
    connection.on("hello", ({ chart, recoveries }) => this.build(chart, recoveries));
    this.last = document.createElement("ol");
    this.last.className = "transitions";
    this.last.setAttribute("aria-label", "Last transitions");
    connection.on("run", () => {
      this.light(this.initial);
      this.last.replaceChildren();
    });
    connection.on("record", ({ record }) => {
      if (record.kind !== "transition") return;
      const to = this.boxes.has(record.to) ? record.to : record.state; // after a pause: history
      if (record.source !== to && this.active.get(this.region(to)) !== to) this.note(record, to); // the end is recorded twice
      this.enter(to);
    });
  }

  build({ regions, initial, words }, recoveries) {
    this.initial = initial;
    this.words = words;
    this.recoveries = recoveries;
    this.boxes.clear();
    this.last.replaceChildren();
    this.element.replaceChildren(...regions.map((region) => this.box(region, null)), this.last);
    this.light([]);
  }

  note({ t, source, event, reason }, to) {
    const item = document.createElement("li");
    const words = `${source} → ${to}, ${reason ?? event ?? ""}`.replaceAll("_", " ").replace(/, $/, "");
    item.textContent = `${t.toFixed(1).padStart(6)} s  ${words}`;
    this.last.append(item);
    while (this.last.children.length > TRANSITIONS) this.last.firstChild.remove();
  }

  box({ state: id, inner }, parent) {
    const box = document.createElement("div");
    box.className = "state";
    box.title = this.words[id] ?? "";
    box.addEventListener("click", (event) => { // a phone shows no title
      event.stopPropagation();
      this.hint.textContent = `${id.replaceAll("_", " ")}: ${box.title}`;
    });
    this.parents.set(id, parent);
    this.boxes.set(id, box);
    if (inner.length) {
      box.classList.add("compound");
      const title = document.createElement("span");
      title.className = "title";
      title.textContent = id.replaceAll("_", " ");
      box.append(title, ...inner.map((each) => this.box(each, id)));
    } else {
      const recovery = this.recoveries[id];
      box.textContent = id.replaceAll("_", " ");
      if (recovery) {
        box.classList.add("recovery");
        box.style.setProperty("--mark", `rgb(${recovery.rgb.join(",")})`);
      }
    }
    return box;
  }

  region(id) {
    let top = id;
    while (this.parents.get(top)) top = this.parents.get(top);
    return top;
  }

  light(states) {
    this.active = new Map(states.map((id) => [this.region(id), id]));
    this.show();
  }

  enter(id) {
    this.active.set(this.region(id), id);
    this.show();
  }

  show() {
    const lit = new Set();
    for (const id of this.active.values()) for (let at = id; at; at = this.parents.get(at)) lit.add(at);
    for (const [id, box] of this.boxes) {
      box.classList.toggle("active", lit.has(id));
      if (lit.has(id)) box.setAttribute("aria-current", "true");
      else box.removeAttribute("aria-current");
    }
  }
}
