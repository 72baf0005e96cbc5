// One robot of a classroom: picture, state, last result, and a link to its own page.

import { sayEmpty } from "./camera.js";

export class Tile {
  constructor({ name, color }, connection, chosen) {
    this.name = name;
    this.running = false;
    this.element = document.getElementById("tile").content.firstElementChild.cloneNode(true);
    this.part = (selector) => this.element.querySelector(selector);
    this.element.dataset.name = name;
    this.element.style.setProperty("--mark", color);
    const page = `robot/${encodeURIComponent(name)}/`;
    this.part(".name").textContent = name;
    this.part(".name").href = this.part(".view").href = page;
    this.part(".view").setAttribute("aria-label", `page of ${name}`);
    sayEmpty(this.part("canvas"));
    this.part("canvas").setAttribute("aria-label", `what the camera of ${name} sees`);
    this.box = this.part("input");
    this.box.setAttribute("aria-label", `choose ${name}`);
    this.box.addEventListener("change", chosen);
    this.part(".beep").setAttribute("aria-label", `make ${name} beep`);
    this.part(".beep").addEventListener("click", () => connection.send({ type: "beep", robot: name }));
    this.part(".return").setAttribute("aria-label", `back to the brick of ${name}`);
    this.part(".return").addEventListener("click", () => connection.send({ type: "return_to_brick", robot: name }));
  }

  get chosen() {
    return this.box.checked;
  }

  set chosen(is) {
    this.box.checked = is;
  }

  show({ brick, open, trouble, doing, battery_mv, stopped, lags, running, last }) {
    this.running = Boolean(running);
    const standsIn = brick === "stand-in";
    this.element.classList.toggle("stopped", stopped);
    this.part(".doing").textContent = stopped ? "stopped until released" : open ? doing : trouble ? "not open" : "opening …";
    this.part(".trouble").hidden = !trouble;
    this.part(".trouble").textContent = standsIn ? `Simulated in place of the brick: ${trouble}` : trouble;
    const link = standsIn || brick === "sim" ? "simulated" : `${brick}${open ? "" : ", not connected"}`;
    const volts = battery_mv ? `${(battery_mv / 1000).toFixed(1)} V` : "";
    this.part(".facts").textContent = [link, volts, lags ? "slower than real time" : ""].filter(Boolean).join(", ");
    this.part(".last").textContent = running ? `mission: ${running}` : last ? `last: ${last.ending}, ${last.reached} of ${last.targets} targets${last.seconds ? `, ${last.seconds.toFixed(0)} s` : ""}` : "";
    this.part(".last").classList.toggle("good", !running && Boolean(last?.achieved));
    this.part(".return").hidden = !standsIn;
  }

  picture(bitmap) {
    const canvas = this.part("canvas");
    [canvas.width, canvas.height] = [bitmap.width, bitmap.height];
    canvas.getContext("2d").drawImage(bitmap, 0, 0);
    bitmap.close();
  }
}
