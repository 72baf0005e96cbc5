// Drive forward for two seconds through `nxtdrive web`; Node 22 or newer has WebSocket.

const page = new WebSocket("ws://127.0.0.1:7080/ws");
const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

async function drive(ahead, seconds) {
  for (let sent = 0; sent < seconds * 20; sent++) {
    page.send(JSON.stringify({ type: "drive", ahead, turn: 0 }));
    await sleep(50);
  }
}

page.onmessage = async ({ data }) => {
  const message = typeof data === "string" ? JSON.parse(data) : {};
  if (message.type !== "hello") return;
  console.log("I am", message.you);
  await drive(0, 0.05);
  await drive(1, 2);
  await drive(0, 0.05);
  page.close();
};
