// The map that grows: forward at the start is up; millimetres, x forward, y to the right.

import { BELIEF, GRID } from "./connection.js";

const CELL_MM = 80, PLACE_MM = 400; // a pixel of the occupancy grid and one of the belief; the start lies in their middle
const VIEW_MM = 700, CONE_DEG = 15;
// the robot's numbers by common builds, until the server says its own
const USUAL = { sonar_forward_mm: 100, forward_mm: 0, right_mm: 0, yaw_deg: 0, hfov_deg: 60 };
const FARTHEST_ECHO_MM = 1500; // beyond, the cone is wider than a robot, and an echo is not a place
const MARGIN_MM = 900; // around the path and the sightings

export class FloorMap {
  constructor(connection, canvas, layers = {}) {
    this.canvas = canvas;
    this.layers = layers;
    this.clear();
    this.robot = USUAL;
    connection.on("hello", () => this.clear());
    connection.on("robot", (robot) => { this.robot = robot; this.draw(); });
    connection.on("run", ({ robot }) => { this.robot = robot; this.clear(); });
    connection.on("ended", () => { this.origin = this.pose; });
    let saved = true;
    connection.on("calibration", (now) => { // after both, the pose begins again
      if (now.running || (now.saved && !saved)) this.clear();
      saved = now.saved;
    });
    connection.on("state", (state) => this.moved(placed(this.origin, state.pose), state.range_mm ?? null));
    connection.on("record", ({ record }) => this.record(record));
    connection.on(`image ${GRID}`, ({ bitmap }) => { this.free = tinted(bitmap, freeColour); this.obstacles = tinted(bitmap, obstacleColour); bitmap.close(); this.draw(); });
    connection.on(`image ${BELIEF}`, ({ bitmap }) => { this.belief = tinted(bitmap, beliefColour); bitmap.close(); this.draw(); });
    connection.on("true_room", (room) => { this.room = { ...room, origin: this.origin }; this.draw(); });
    for (const layer of Object.values(layers)) layer.addEventListener("change", () => this.draw());
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  clear() {
    this.path = [];
    this.echoes = new Map();
    this.sightings = new Map();
    this.marks = [];
    this.pose = [0, 0, 0];
    this.origin = [0, 0, 0]; // of the messages' frame: after a mission it begins where the robot stands
    this.range = null;
    this.free = this.obstacles = this.belief = this.room = null;
    this.box = [0, 0, 0, 0]; // least and greatest x, least and greatest y
    this.draw();
  }

  record(record) {
    this.inView = ["arrive", "verify"].includes(record.state);
    if (record.pose) this.moved(record.pose, record.range_mm ?? null);
    if (record.kind === "look" && record.sighting && !record.sighting.bound) {
      const at = ahead(this.lens(), record.sighting.distance_mm, record.sighting.bearing_deg);
      this.sightings.set(record.target, at);
      this.include(at);
    }
    if (record.kind === "choice") this.marks.push({ at: this.pose, choice: record.choice });
  }

  moved(pose, range) {
    const last = this.path.at(-1);
    if (!last || Math.hypot(pose[0] - last[0], pose[1] - last[1]) > 20) this.path.push(pose);
    this.pose = pose;
    this.range = range;
    if (range !== null && range < FARTHEST_ECHO_MM) {
      const at = ahead(pose, range + this.robot.sonar_forward_mm, 0);
      this.echoes.set(at.map((mm) => Math.round(mm / 40)).join(), at);
      this.include(at);
    }
    this.include(pose);
    this.draw();
  }

  lens() {
    const [x, y, heading] = this.pose;
    return [...ahead([...ahead(this.pose, this.robot.forward_mm, 0), heading], this.robot.right_mm, 90), heading];
  }

  include([x, y]) {
    const [x0, x1, y0, y1] = this.box;
    this.box = [Math.min(x0, x), Math.max(x1, x), Math.min(y0, y), Math.max(y1, y)];
  }

  draw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.paint(); });
  }

  paint() {
    const canvas = this.canvas, side = Math.round(canvas.clientWidth * devicePixelRatio);
    if (!side) return;
    if (canvas.width !== side) canvas.width = canvas.height = side;
    const context = canvas.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = "#e9ecef";
    context.fillRect(0, 0, side, side);
    const [x0, x1, y0, y1] = this.box;
    const wide = Math.max(x1 - x0, y1 - y0) + 2 * MARGIN_MM, scale = side / wide;
    // x forward is up, y to the right
    context.setTransform(scale, 0, 0, scale, side / 2 - ((y0 + y1) / 2) * scale, side / 2 + ((x0 + x1) / 2) * scale);
    // the belief covers whole rooms: obstacles come after it, or they would take its colour
    const known = this.obstacles && this.layers.grid.checked;
    if (known) paintLayer(context, this.free, CELL_MM);
    if (this.belief && this.layers.belief.checked && !this.inView) paintLayer(context, this.belief, PLACE_MM, true);
    if (known) paintLayer(context, this.obstacles, CELL_MM);
    if (this.room && this.layers.truth?.checked) this.paintRoom(context, 2 / scale * devicePixelRatio);
    this.paintLines(context, 1 / scale * devicePixelRatio);
    context.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    this.paintScale(context, wide, side / devicePixelRatio);
  }

  paintRoom(context, wide) {
    context.strokeStyle = "#a020a0";
    context.lineWidth = wide;
    context.beginPath();
    const { origin, lines, pose } = this.room;
    for (const line of lines) {
      const [x0, y0] = placed(origin, line), [x1, y1] = placed(origin, line.slice(2));
      context.moveTo(y0, -x0);
      context.lineTo(y1, -x1);
    }
    const [x, y, heading] = placed(origin, pose), [noseX, noseY] = ahead([x, y, heading], 130, 0);
    context.moveTo(y + 100, -x);
    context.arc(y, -x, 100, 0, 2 * Math.PI);
    context.moveTo(y, -x);
    context.lineTo(noseY, -noseX);
    context.stroke();
  }

  paintLines(context, pixel) {
    const [x, y, heading] = this.pose;
    context.lineWidth = pixel;
    context.strokeStyle = "#9aa5b1";
    cross(context, [0, 0], 60);
    for (const at of this.echoes.values()) disc(context, at, 2 * pixel, "#5b6672");
    context.strokeStyle = "#0b5fb0";
    context.lineWidth = 2 * pixel;
    context.beginPath();
    for (const [px, py] of this.path) context.lineTo(py, -px);
    context.stroke();
    const [lensX, lensY] = this.lens();
    wedge(context, [lensX, lensY, heading + this.robot.yaw_deg], this.robot.hfov_deg / 2, VIEW_MM, "#0b5fb022");
    if (this.range !== null) wedge(context, this.pose, CONE_DEG, this.range, "#00857a38");
    for (const [name, at] of this.sightings) {
      disc(context, at, 45, "#1b9a4a");
      label(context, name, at, 14 * pixel, "#0d5c2a");
    }
    context.save();
    context.translate(y, -x);
    context.rotate((heading * Math.PI) / 180);
    context.fillStyle = "#17202b";
    context.beginPath();
    context.moveTo(0, -130);
    context.lineTo(80, 90);
    context.lineTo(-80, 90);
    context.fill();
    context.restore();
    for (const [at, numbers] of gathered(this.marks, 18 * pixel)) label(context, numbers, at, 13 * pixel, "#8a1015");
  }

  paintScale(context, wide, side) {
    const metres = wide > 8000 ? 2 : wide > 4000 ? 1 : 0.5;
    context.fillStyle = context.strokeStyle = "#17202b";
    context.lineWidth = 2;
    context.strokeRect(12, side - 16, (metres * 1000 * side) / wide, 0);
    context.font = "12px system-ui, sans-serif";
    context.fillText(`${metres} m`, 12, side - 22);
  }
}

function ahead([x, y, heading], distance, bearing) {
  const angle = ((heading + bearing) * Math.PI) / 180;
  return [x + distance * Math.cos(angle), y + distance * Math.sin(angle)];
}

// a pose, or a place, of the frame that begins at `origin`
function placed(origin, [x, y, heading = 0]) {
  const [aheadX, aheadY] = ahead(origin, x, 0);
  return [...ahead([aheadX, aheadY, origin[2]], y, 90), origin[2] + heading];
}

function wedge(context, pose, half, distance, colour) {
  const middle = ((pose[2] - 90) * Math.PI) / 180, wide = (half * Math.PI) / 180;
  context.fillStyle = colour;
  context.beginPath();
  context.moveTo(pose[1], -pose[0]);
  context.arc(pose[1], -pose[0], distance, middle - wide, middle + wide);
  context.fill();
}

function disc(context, [x, y], radius, colour) {
  context.fillStyle = colour;
  context.beginPath();
  context.arc(y, -x, radius, 0, 2 * Math.PI);
  context.fill();
}

function cross(context, [x, y], size) {
  context.beginPath();
  context.moveTo(y - size, -x);
  context.lineTo(y + size, -x);
  context.moveTo(y, -x - size);
  context.lineTo(y, -x + size);
  context.stroke();
}

function label(context, text, [x, y], size, colour) {
  context.font = `bold ${size}px system-ui, sans-serif`;
  context.fillStyle = colour;
  context.strokeStyle = "#ffffff"; // a rim, to be read on obstacles, too
  context.lineWidth = size * 0.2;
  context.lineJoin = "round";
  const { a, e } = context.getTransform(), right = (context.canvas.width - e) / a;
  const left = Math.min(y + size * 0.6, right - size * 0.2 - context.measureText(text).width); // not beyond the map
  context.strokeText(text, left, -x - size * 0.4);
  context.fillText(text, left, -x - size * 0.4);
}

// marks nearer than a distance to the first of them share a label: "1, 3–5"
function gathered(marks, near) {
  const places = [];
  marks.forEach(({ at: [x, y] }, index) => {
    const place = places.find(({ at }) => Math.hypot(at[0] - x, at[1] - y) < near);
    if (place) place.numbers.push(index + 1);
    else places.push({ at: [x, y], numbers: [index + 1] });
  });
  return places.map(({ at, numbers }) => [at, ranges(numbers)]);
}

function ranges(numbers) {
  const found = [];
  for (const number of numbers) {
    if (found.at(-1)?.[1] === number - 1) found.at(-1)[1] = number;
    else found.push([number, number]);
  }
  return found.map(([first, last]) => (last > first + 1 ? `${first}–${last}` : first === last ? first : `${first}, ${last}`)).join(", ");
}

// evidence 0 is grey 128 and unknown; above it something stands there, below it the floor is free
function obstacleColour(grey) {
  return [60, 66, 74, grey > 140 ? Math.min(255, (grey - 128) * 2) : 0];
}

function freeColour(grey) {
  return [255, 255, 255, grey < 116 ? Math.min(255, (128 - grey) * 2.5) : 0];
}

function paintLayer(context, image, pixelMm, smooth = false) {
  const side = image.width * pixelMm;
  context.imageSmoothingEnabled = smooth;
  context.drawImage(image, -side / 2, -side / 2, side, side);
}

// the square lets the places stand out from the plain that the target is in with little chance
function beliefColour(grey) {
  return [230, 120, 0, 150 * (grey / 255) ** 2];
}

function tinted(bitmap, colour) {
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [bitmap.width, bitmap.height];
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(bitmap, 0, 0);
  const image = context.getImageData(0, 0, canvas.width, canvas.height);
  for (let i = 0; i < image.data.length; i += 4) image.data.set(colour(image.data[i]), i);
  context.putImageData(image, 0, 0);
  return canvas;
}
