// Pad, keys and gamepad. Everything that may mean that the controls were released sends a stop of the motion at once;
// the server stops the robot by itself when it receives nothing for half a second.

const EVERY_MS = 50;
const KEYS = {
  ArrowUp: [1, 0], KeyW: [1, 0], ArrowDown: [-1, 0], KeyS: [-1, 0],
  ArrowLeft: [0, -1], KeyA: [0, -1], ArrowRight: [0, 1], KeyD: [0, 1],
};
const DEAD_ZONE = 0.2;

export class Drive {
  constructor(connection, pad, knob) {
    this.connection = connection;
    this.pad = pad;
    this.knob = knob;
    this.held = new Set();
    this.dragged = null;
    this.padUsed = false;
    this.moving = false;
    this.listenToPad();
    this.listenToKeys();
    for (const leaving of ["blur", "pagehide"]) addEventListener(leaving, () => this.letGo());
    document.addEventListener("visibilitychange", () => document.hidden && this.letGo());
    setInterval(() => this.tick(), EVERY_MS);
  }

  listenToPad() {
    let box = null;
    const move = (event) => {
      const radius = box.width / 2;
      const x = (event.clientX - box.left) / radius - 1, y = 1 - (event.clientY - box.top) / radius;
      const far = Math.max(1, Math.hypot(x, y));
      this.dragged = [y / far, x / far];
      this.tick();
    };
    this.pad.addEventListener("pointerdown", (event) => {
      if (event.button) return; // the menu of another one would hide that it is released
      this.pad.setPointerCapture(event.pointerId);
      box = this.pad.getBoundingClientRect(); // where it was touched: what the page shows then may move it
      this.connection.send({ type: "drive", ahead: 0, turn: 0 });
      move(event);
    });
    this.pad.addEventListener("pointermove", (event) => this.dragged && move(event));
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
      this.pad.addEventListener(end, () => this.letGo());
    }
  }

  listenToKeys() {
    addEventListener("keydown", (event) => {
      if (event.key === "Meta") this.letGo(); // while it is held, macOS reports no release of other keys
      if (event.target.closest("input, select, textarea") || event.ctrlKey || event.altKey || event.metaKey) return;
      if (event.target.closest("#lines, #decision") && event.key.startsWith("Arrow")) return; // they scroll there
      if (event.code in KEYS) {
        event.preventDefault();
        if (!event.repeat) this.held.add(event.code);
        this.tick();
      }
    });
    addEventListener("keyup", (event) => {
      if (this.held.delete(event.code)) this.tick();
    });
  }

  wanted() {
    if (this.dragged) return this.dragged;
    let [ahead, turn] = [0, 0];
    for (const code of this.held) [ahead, turn] = [ahead + KEYS[code][0], turn + KEYS[code][1]];
    if (ahead || turn) return [clamp(ahead), clamp(ahead ? turn / 2 : turn)];
    return gamepad();
  }

  tick() {
    const [ahead, turn] = this.wanted();
    const moving = Boolean(ahead || turn);
    if (moving && !this.moving) this.connection.send({ type: "drive", ahead: 0, turn: 0 });
    if (moving || this.moving) this.connection.send({ type: "drive", ahead, turn });
    this.moving = moving;
    this.knob.style.left = `${50 + 33 * turn}%`;
    this.knob.style.top = `${50 - 33 * ahead}%`;
  }

  letGo() {
    this.dragged = null;
    this.held.clear();
    this.tick();
  }
}

function gamepad() {
  if (document.hidden) return [0, 0]; // what the browser has may be old
  for (const pad of navigator.getGamepads?.() ?? []) {
    if (!pad) continue;
    const ahead = beyond(-pad.axes[1]), turn = beyond(pad.axes[2] ?? 0) || beyond(pad.axes[0]);
    if (ahead || turn) return [ahead, turn];
  }
  return [0, 0];
}

function beyond(value) {
  const size = (Math.abs(value) - DEAD_ZONE) / (1 - DEAD_ZONE);
  return size > 0 ? Math.sign(value) * Math.min(1, size) : 0;
}

function clamp(value) {
  return Math.max(-1, Math.min(1, value));
}
