// A target by photograph: takes the camera's picture, lets one draw a box on it, and has the server add the target.

import { sayEmpty } from "./camera.js";
import { ask } from "./page.js";

export class Photograph {
  constructor(find, editor) {
    this.find = find;
    this.editor = editor;
    this.picture = null;
    this.sides = ["left", "top", "width", "height"].map((side) => find(`box-${side}`));
    find("take").addEventListener("click", () => this.take());
    find("target-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.add();
    });
    for (const side of this.sides) side.addEventListener("input", () => this.draw());
    this.listen(find("photo"));
    sayEmpty(find("photo"));
  }

  listen(canvas) {
    let start = null;
    const at = (event) => {
      const box = canvas.getBoundingClientRect();
      const inside = (value, size) => Math.round(Math.max(0, Math.min(1, value)) * size);
      return [inside((event.clientX - box.left) / box.width, canvas.width), inside((event.clientY - box.top) / box.height, canvas.height)];
    };
    canvas.addEventListener("pointerdown", (event) => {
      if (!this.picture) return;
      canvas.setPointerCapture(event.pointerId);
      start = at(event);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!start) return;
      const end = at(event);
      this.box = [Math.min(start[0], end[0]), Math.min(start[1], end[1]), Math.abs(end[0] - start[0]), Math.abs(end[1] - start[1])];
      this.draw();
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => (start = null));
  }

  get box() {
    return this.sides.map(({ value }) => Math.round(Number(value)));
  }

  set box(numbers) {
    this.sides.forEach((side, index) => (side.value = numbers[index]));
  }

  async take() {
    const answer = await ask("api/pictures", { method: "POST" });
    if (!answer.ok) return this.editor.notice(await answer.text());
    this.picture = { number: Number(answer.headers.get("x-picture")), bitmap: await createImageBitmap(await answer.blob()) };
    this.box = [0, 0, 0, 0];
    this.editor.notice("");
    this.draw();
  }

  async add() {
    const target = {
      text: this.editor.text(), name: this.find("target-name").value.trim(), height_mm: Number(this.find("target-height").value),
      picture: this.picture.number, box: this.box,
    };
    const answer = await ask("api/targets", { method: "POST", body: JSON.stringify(target) });
    if (!answer.ok) return this.editor.notice(await answer.text());
    this.editor.notice("");
    this.editor.show((await answer.json()).text);
  }

  draw() {
    if (!this.picture) return;
    const canvas = this.find("photo"), context = canvas.getContext("2d"), { bitmap } = this.picture;
    if (canvas.width !== bitmap.width) [canvas.width, canvas.height] = [bitmap.width, bitmap.height];
    context.drawImage(bitmap, 0, 0);
    const box = this.box;
    this.find("add").disabled = !(box[2] && box[3]);
    context.lineWidth = 2;
    context.strokeStyle = "#20d060";
    context.strokeRect(...box);
  }
}
