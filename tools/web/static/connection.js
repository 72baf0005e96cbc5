// The WebSocket: opens again by itself, and hands each message to the listener of its type.

const RETRY_MS = 1000;
const STOPS = ["stop", "stop_all"]; // requests that hold however late they arrive
// what comes the first time after a stop shows that the connection was still there; a lost one closes within the second
const ARRIVED_MS = 1000, CLOSES_MS = 30000;
export const FRAME = 1, GRID = 2, BELIEF = 3;

export class Connection {
  constructor() {
    this.listeners = new Map();
    this.ended = false;
    this.unsent = null;
    this.stop = null; // sent, but perhaps into a connection that was lost already
    this.open();
  }

  on(type, listener) {
    const known = this.listeners.get(type) ?? [];
    this.listeners.set(type, [...known, listener]);
  }

  send(message) {
    if (STOPS.includes(message.type)) this.stop = { message, at: performance.now() };
    if (message.type.startsWith("release")) this.stop = null;
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
    else if (STOPS.includes(message.type)) this.unsent = message;
  }

  // nothing more will come: do not open again
  end() {
    this.ended = true;
  }

  open() {
    this.socket = new WebSocket(new URL("ws", location.href.replace(/^http/, "ws")));
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => {
      if (this.unsent) this.send(this.unsent);
      this.unsent = null;
    };
    this.socket.onmessage = ({ data }) => {
      if (this.stop && performance.now() - this.stop.at > ARRIVED_MS) this.stop = null;
      return typeof data === "string" ? this.text(JSON.parse(data)) : this.image(data);
    };
    this.socket.onclose = () => {
      if (this.ended) return;
      if (this.stop && performance.now() - this.stop.at < CLOSES_MS) this.unsent = this.stop.message;
      this.tell("closed", {});
      setTimeout(() => this.reopen(), RETRY_MS);
    };
  }

  // a session ends with the server's program; the next one asks for its own PIN
  async reopen() {
    const status = await fetch("/api/session").then((answer) => answer.status, () => 0);
    if (status === 401) location.replace("/pin.html");
    else this.open();
  }

  text(message) {
    this.tell(message.type, message);
  }

  async image(data) {
    const head = new DataView(data, 0, 16);
    const [kind, number, time_s] = [head.getUint8(0), head.getUint32(4, true), head.getFloat64(8, true)];
    if (!this.listeners.has(`image ${kind}`)) return;
    const bitmap = await createImageBitmap(new Blob([new Uint8Array(data, 16)]));
    this.tell(`image ${kind}`, { number, time_s, bitmap });
  }

  tell(type, message) {
    for (const listener of this.listeners.get(type) ?? []) listener(message);
  }
}
