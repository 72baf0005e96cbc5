// Replays the records of a run: it speaks to the parts of the page as the live connection does.

export class Player {
  constructor({ robot, records, lines, decisions, pictures, chart, recoveries }) {
    this.robot = robot;
    this.listeners = new Map();
    this.hello = { chart, recoveries };
    this.events = [
      ...records.map((record) => ({ t: record.t, type: "record", message: { record } })),
      ...lines.map((line) => ({ t: line.t, type: "line", message: line })),
      ...decisions.map((each) => ({ t: each.t, type: "decision", message: each })),
    ].sort((one, other) => one.t - other.t);
    this.decisions = records.filter(({ kind }) => kind === "choice").map(({ t }) => t);
    this.duration = Math.max(this.events.at(-1)?.t ?? 0, pictures.at(-1)?.t ?? 0);
    this.next = 0;
    this.time = 0;
  }

  on(type, listener) {
    this.listeners.set(type, [...(this.listeners.get(type) ?? []), listener]);
  }

  // a damaged record may stop one part of the page, not the replay
  tell(type, message) {
    for (const listener of this.listeners.get(type) ?? []) {
      try {
        listener(message);
      } catch (error) {
        console.warn("a part of the page cannot show", message, error);
      }
    }
  }

  begin() {
    this.tell("hello", this.hello);
    this.seek(0);
  }

  seek(time) {
    if (time <= this.time) {
      this.next = 0;
      this.tell("run", { robot: this.robot });
    }
    this.time = Math.max(0, Math.min(time, this.duration));
    for (; this.next < this.events.length && this.events[this.next].t <= this.time; this.next++) {
      const { type, message } = this.events[this.next];
      this.tell(type, message);
    }
    this.tell("time", { time: this.time });
  }

  // the decision after now, or before: -1
  jump(way) {
    const later = this.decisions.filter((t) => (way > 0 ? t > this.time + 0.01 : t < this.time - 0.01));
    const to = way > 0 ? later[0] : later.at(-1);
    if (to !== undefined) this.seek(to + 0.001);
  }
}
