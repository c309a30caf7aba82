// Keeps marked parts of a page up to date: every 2 s while the page is looked at, and says when nobody answers.
const PERIOD = 2000;

const poll = () => {
  if (document.hidden) return;
  for (const part of document.querySelectorAll("[data-poll]")) part.dispatchEvent(new Event("poll"));
};

setInterval(poll, PERIOD);
document.addEventListener("visibilitychange", poll);

let notice = null;

const say = (text) => {
  if (!notice) {
    notice = document.createElement("p");
    notice.className = "offline";
    notice.setAttribute("role", "status");
    document.body.append(notice);
  }
  notice.textContent = text;
};

document.addEventListener("htmx:error", () => say("Pebble does not answer. Trying again every 2 s."));
document.addEventListener("htmx:response:error", (event) => {
  if (event.detail.ctx.response.status === 401) location.reload();
  else say("Pebble could not answer. Trying again every 2 s.");
});
document.addEventListener("htmx:after:swap", () => {
  notice?.remove();
  notice = null;
});
