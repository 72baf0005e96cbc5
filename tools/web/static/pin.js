// Enters the PIN; the server answers with a session's cookie.

const find = (id) => document.getElementById(id);

find("pin-form").addEventListener("submit", async (event) => {
  event.preventDefault();
  const answer = await fetch("/api/session", { method: "POST", body: find("pin").value });
  if (answer.ok) return location.replace("/");
  find("notice").textContent = await answer.text();
  find("notice").hidden = false;
  find("pin").select();
});
