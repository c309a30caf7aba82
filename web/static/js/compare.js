// Says how many runs are ticked, and lets them be compared; one is enough to begin with.
const MOST = 12;

const say = (count) => {
  if (count > MOST) return `${count} runs chosen; at most ${MOST} can be compared.`;
  if (count > 1) return `${count} runs chosen.`;
  return count ? "1 run chosen. Tick others, or add them next." : "Tick runs to see their curves together.";
};

const show = () => {
  const form = document.querySelector("[data-compare]");
  if (!form) return;
  const count = document.querySelectorAll("input[name=run]:checked").length;
  form.querySelector("button").disabled = !count || count > MOST;
  form.querySelector("[data-compare-chosen]").textContent = say(count);
};

document.addEventListener("change", show);
document.addEventListener("htmx:after:swap", show);
addEventListener("pageshow", show); // back from the comparison, the ticks are as they were
show();
