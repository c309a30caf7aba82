// The policy's video at a chosen step of training; new videos join at the end as they are made.
import { decimal, measure, number } from "./numbers.js";

const PERIOD = 5000;
const panel = document.querySelector("[data-policy]");
const video = panel.querySelector("video");
const slider = panel.querySelector("[data-video-slider]");
const caption = panel.querySelector("[data-video-step]");
const still = matchMedia("(prefers-reduced-motion: reduce)");

let shown = [];

const show = (found) => {
  const playing = !video.paused;
  if (!video.src.endsWith(found.video_url)) {
    video.src = found.video_url;
    if (playing) video.play().catch(() => {});
  }
  const measures = Object.entries(found.measures).map(([name, value]) => `${name.replaceAll("_", " ")} ${measure(value)}`);
  const said = [`true return ${decimal(found.mean_return)}`, ...measures].join(", ");
  caption.textContent = `After step ${number(found.step)}: ${said}`;
  document.dispatchEvent(new CustomEvent("step:chosen", { detail: found.step }));
};

const refresh = async () => {
  if (document.hidden) return;
  const reply = await fetch(panel.dataset.source).catch(() => null);
  if (!reply?.ok) return;
  const found = (await reply.json()).filter((evaluation) => evaluation.video_url);
  if (!found.length) return;
  const first = !shown.length;
  const atEnd = first ? slider.value === slider.max : Number(slider.value) === shown.length - 1;
  if (found.length === shown.length) return;
  shown = found;
  slider.max = shown.length - 1;
  if (atEnd) slider.value = slider.max;
  slider.hidden = shown.length < 2;
  for (const part of [video, slider.parentElement]) part.hidden = false;
  panel.querySelector(".policy-none").hidden = true;
  show(shown[Number(slider.value)]);
};

slider.addEventListener("input", () => show(shown[Number(slider.value)]));
slider.setAttribute("aria-describedby", "policy-step");
setInterval(refresh, PERIOD);
await refresh();
if (!still.matches && shown.length) video.play().catch(() => {});
