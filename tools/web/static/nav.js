// In a classroom, the pages of a robot show its name and lead back to the page of all robots.

const nav = document.querySelector("nav");
if (nav && location.pathname.startsWith("/robot/")) {
  nav.querySelector('a[href="./"]').textContent = decodeURIComponent(location.pathname.split("/")[2]);
  const link = document.createElement("a");
  link.href = "/";
  link.textContent = "classroom";
  nav.prepend(link, " ");
  nav.querySelector('a[href="calibrate.html"]').remove(); // a classroom's robots are calibrated alone
}
