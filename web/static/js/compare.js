// Says how many runs are ticked, and lets them be compared once there are enough.
const FEWEST = 2;
const MOST = 12;

const say = (count) => {
  if (count > MOST) return `${count} runs chosen; at most ${MOST} can be compared.`;
  if (count >= FEWEST) return `${count} runs chosen.`;
  return count ? "One more, at least." : "Tick runs to see their curves together.";
};

const show = () => {
  const form = document.querySelector("[data-compare]");
  if (!form) return;
  const count = document.querySelectorAll("input[name=run]:checked").length;
  form.querySelector("button").disabled = count < FEWEST || count > MOST;
  form.querySelector("[data-compare-chosen]").textContent = say(count);
};

document.addEventListener("change", show);
document.addEventListener("htmx:after:swap", show);
addEventListener("pageshow", show); // back from the comparison, the ticks are as they were
show();
