// The recorded picture of the moment, with the boxes of the looks that used it.

import { drawBox } from "./camera.js";

const AHEAD = 10; // pictures that are fetched before they are shown

export class RecordedCamera {
  constructor(player, canvas, pictures) {
    this.pictures = pictures;
    this.context = canvas.getContext("2d");
    this.images = new Map(); // of the pictures around the present one
    this.wanted = this.shown = -1;
    player.on("time", ({ time }) => this.show(this.at(time)));
  }

  // index of the latest picture at a time, the first one before it
  at(time) {
    let low = 0, high = this.pictures.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.pictures[middle].t <= time) low = middle + 1;
      else high = middle;
    }
    return Math.max(0, low - 1);
  }

  show(index) {
    if (index === this.wanted) return;
    this.wanted = index;
    for (const old of this.images.keys()) if (old < index || old > index + AHEAD) this.images.delete(old);
    for (let next = index; next <= index + AHEAD && next < this.pictures.length; next++) this.fetch(next);
    this.images.get(index).then((image) => index === this.wanted && this.paint(image, this.pictures[index]));
  }

  fetch(index) {
    if (this.images.has(index)) return;
    const image = new Image();
    image.src = this.pictures[index].src;
    this.images.set(index, image.decode().then(() => image, () => null));
  }

  paint(image, { looks }) {
    const { context } = this, { canvas } = context;
    if (!image) {
      context.clearRect(0, 0, canvas.width, canvas.height);
      context.font = "16px system-ui, sans-serif";
      context.fillStyle = "#ffffff";
      context.fillText("This picture cannot be read.", 12, 28);
      return;
    }
    if (canvas.width !== image.width || canvas.height !== image.height) [canvas.width, canvas.height] = [image.width, image.height];
    context.drawImage(image, 0, 0);
    for (const { target, sighting, found } of looks) {
      for (const other of found) if (String(other.box) !== String(sighting?.box)) drawFound(context, other);
      if (sighting) drawBox(context, { ...sighting, target });
    }
  }
}

// a place that looks like the target and is not confirmed
function drawFound(context, { box: [x, y, width, height], score }) {
  context.lineWidth = 2;
  context.strokeStyle = "#ffbe00";
  context.strokeRect(x, y, width, height);
  context.font = "bold 12px system-ui, sans-serif";
  context.fillStyle = "#ffbe00";
  context.fillText(score.toFixed(2), x + 2, y > 14 ? y - 4 : y + 14);
}
