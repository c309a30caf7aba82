// What the answers have taught, as the server writes it: fetched again when there is something new.

import { motionIsWelcome } from "./motion.js";

/** Part of the page that is fetched whenever `marker` changes. */
export class Fragment {
  #busy = false;

  /** @param {HTMLElement} element @param {string} address */
  constructor(element, address) {
    this.element = element;
    this.address = address;
    this.marker = element.dataset.marker;
    dressVideos(element);
  }

  async update(marker) {
    if (marker === this.marker || this.#busy) return;
    this.#busy = true;
    const reply = await fetch(this.address).catch(() => null);
    this.#busy = false;
    if (!reply?.ok) return;
    this.element.innerHTML = await reply.text();
    this.marker = marker;
    dressVideos(this.element);
  }
}

/** Videos loop in silence beside the clips; those who want no motion start them themselves. */
function dressVideos(element) {
  for (const video of element.querySelectorAll("video")) {
    video.muted = true;
    const button = video.parentElement.querySelector("[data-play]");
    video.removeAttribute("controls");
    button.hidden = false;
    button.addEventListener("click", () => (video.paused ? video.play() : video.pause()));
    for (const type of ["play", "pause"]) video.addEventListener(type, () => label(button, video));
    label(button, video);
    if (motionIsWelcome()) video.play().catch(() => {});
  }
}

function label(button, video) {
  button.textContent = video.paused ? "Play" : "Pause";
}
