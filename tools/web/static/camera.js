// The camera's picture with the box of the last sighting.

import { FRAME } from "./connection.js";

const BOX_MS = 700;
const STALE_MS = 2000;
const LABEL_PX = 15;

// on a canvas that would be plain until its first picture comes
export function sayEmpty(canvas) {
  const context = canvas.getContext("2d");
  context.font = "16px sans-serif";
  context.textAlign = "center";
  context.fillStyle = "gray";
  context.fillText("no picture yet", canvas.width / 2, canvas.height / 2);
  context.textAlign = "start";
}

export function showCamera(connection, canvas) {
  const context = canvas.getContext("2d");
  sayEmpty(canvas);
  const stale = (is) => canvas.classList.toggle("stale", is);
  let seen = null, drawn = performance.now();
  connection.on("state", () => stale(performance.now() - drawn > STALE_MS)); // while it is driven by hand
  connection.on("status", () => stale(false)); // a mission reports itself that its camera fails
  connection.on("closed", () => stale(true));
  connection.on("record", ({ record }) => {
    if (record.kind === "look") seen = record.sighting && { ...record.sighting, target: record.target, at: performance.now() };
  });
  connection.on(`image ${FRAME}`, ({ bitmap }) => {
    if (canvas.width !== bitmap.width) [canvas.width, canvas.height] = [bitmap.width, bitmap.height];
    context.drawImage(bitmap, 0, 0);
    bitmap.close();
    drawn = performance.now();
    stale(false);
    if (seen && performance.now() - seen.at < BOX_MS) drawBox(context, seen);
  });
}

export function drawBox(context, seen) {
  const [x, y, width, height] = seen.box;
  const angle = Math.round(seen.bearing_deg), side = angle < 0 ? " left" : angle > 0 ? " right" : "";
  const text = `${seen.target}  ${seen.bound ? "≤ " : ""}${(seen.distance_mm / 1000).toFixed(2)} m  ${Math.abs(angle)}°${side}`;
  context.lineWidth = 2;
  context.strokeStyle = "#20d060";
  context.strokeRect(x, y, width, height);
  context.font = "bold 12px system-ui, sans-serif";
  const wide = context.measureText(text).width + 6;
  const left = Math.max(0, Math.min(x, context.canvas.width - wide));
  const below = y + height + 2 + LABEL_PX <= context.canvas.height ? y + height + 2 : 2;
  const top = y > LABEL_PX + 3 ? y - LABEL_PX - 2 : below;
  context.fillStyle = "#0009";
  context.fillRect(left, top, wide, LABEL_PX);
  context.fillStyle = "#fff";
  context.fillText(text, left + 3, top + 12);
}
