// The curves of a run over one step axis: they share the crosshair and mark the step whose policy is shown.
import { Curves } from "./curves.js";
import { decimal, number } from "./numbers.js";
import { axis, colour, onTheme } from "./plot.js";

const PERIOD = 2000;
const HEIGHT = 150;
const box = document.querySelector("[data-charts]");
const total = Number(box.dataset.steps);
const curves = new Curves(box.dataset.run);
const none = box.querySelector("[data-charts-none]");
let chosenStep = null;

const percent = (value) => (value === null || value === undefined ? "–" : `${Math.round(value * 100)} %`);

const line = (label, name, value, more = {}) => ({
  label,
  stroke: () => colour(name),
  width: 1.5,
  spanGaps: true,
  points: { show: false },
  value: (_plot, at) => value(at),
  ...more,
});

const dots = (name) => ({ points: { show: true, size: 6, fill: () => colour(name) } });

const CHARTS = [
  {
    title: "True return",
    names: ["episode_return", "evaluation"],
    series: [
      line("While training", "line-strong", decimal, { width: 1 }),
      line("Evaluated", "accent", decimal, { width: 2, ...dots("accent") }),
    ],
  },
  {
    title: "Reward model: share of answers it agrees with",
    learned: true,
    names: ["training", "fresh"],
    range: [0, 1],
    tick: percent,
    series: [
      line("Learned from", "line-strong", percent, dots("line-strong")),
      line("New ones", "accent", percent, { width: 2, ...dots("accent") }),
    ],
  },
  {
    title: "Steps per second",
    names: ["steps_per_second"],
    range: (_plot, _low, high) => [0, (high || 100) * 1.1],
    series: [line("Steps/s", "accent", (value) => decimal(value, 0))],
  },
];

const markChosen = (plot) => {
  if (chosenStep === null) return;
  const x = Math.round(plot.valToPos(chosenStep, "x", true));
  plot.ctx.save();
  plot.ctx.strokeStyle = colour("accent");
  plot.ctx.setLineDash([4, 4]);
  plot.ctx.beginPath();
  plot.ctx.moveTo(x, plot.bbox.top);
  plot.ctx.lineTo(x, plot.bbox.top + plot.bbox.height);
  plot.ctx.stroke();
  plot.ctx.restore();
};

const options = (chart, width) => ({
  width,
  height: HEIGHT,
  cursor: { sync: { key: "steps" }, drag: { x: false, y: false }, y: false },
  scales: { x: { time: false, range: [0, total] }, y: chart.range ? { range: chart.range } : {} },
  axes: [
    axis({ values: (_plot, ticks) => ticks.map(number), size: 32 }),
    axis({ values: (_plot, ticks) => ticks.map(chart.tick ?? ((t) => decimal(t, 0))), size: 56, space: 30 }),
  ],
  series: [{ label: "Step", value: (_plot, at) => (at === null ? "–" : number(at)) }, ...chart.series],
  hooks: { draw: [markChosen] },
});

const build = (chart) => {
  const section = document.createElement("section");
  section.className = "chart";
  const heading = document.createElement("h3");
  heading.textContent = chart.title;
  section.append(heading);
  box.append(section);
  const plot = new uPlot(options(chart, box.clientWidth), curves.columns(chart.names), section);
  section.hidden = true;
  return { ...chart, plot, section };
};

const charts = CHARTS.filter((chart) => !chart.learned || box.dataset.learned).map(build);
const redraw = () => charts.forEach(({ plot }) => plot.redraw(false));

const refresh = async () => {
  if (document.hidden) return;
  try {
    await curves.refresh();
  } catch {
    return; // the page itself says when nobody answers
  }
  for (const { plot, names, section } of charts) {
    const columns = curves.columns(names);
    section.hidden = columns[0].length === 0;
    plot.setData(columns);
  }
  none.hidden = charts.some(({ section }) => !section.hidden);
};

new ResizeObserver(() => {
  for (const { plot } of charts) plot.setSize({ width: box.clientWidth, height: HEIGHT });
}).observe(box);
onTheme(redraw);
document.addEventListener("step:chosen", (event) => {
  chosenStep = event.detail;
  redraw();
});

setInterval(refresh, PERIOD);
await refresh();
