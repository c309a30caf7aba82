// Curves over each other in one chart: strong lines named in the legend, and the thin ones that they are the mean of.
import { decimal, number } from "./numbers.js";
import { axis, colour, columns, onTheme } from "./plot.js";

const HEIGHT = 260;
const COLOURS = 8; // --series-1 to --series-8 in tokens.css
const DASHES = [[], [10, 5], [2, 4]]; // as overlay.css draws them beside names

const figure = (value) => decimal(value, Math.abs(value) >= 10 ? 1 : 2);
const tick = (value) => (Number.isInteger(value) ? number(value) : figure(value));

/** A line is { label, place, curve, thin }: `place` decides on colour and dashes, `curve` maps steps to values. */
const series = ({ label, place, thin }) => ({
  label,
  stroke: () => colour(`series-${(place % COLOURS) + 1}`),
  dash: thin ? [] : DASHES[place % DASHES.length],
  width: thin ? 1 : 2,
  alpha: thin ? 0.35 : 1,
  spanGaps: true,
  points: { show: false },
  value: (_plot, value) => (value === null || value === undefined ? "–" : figure(value)),
});

const options = (lines, steps, width) => ({
  width,
  height: HEIGHT,
  cursor: { drag: { x: false, y: false }, y: false, points: { show: false } },
  legend: { markers: { width: 0 } },
  scales: { x: { time: false, range: [0, steps] } },
  axes: [
    axis({ values: (_plot, ticks) => ticks.map(number), size: 32, space: 80 }),
    axis({ values: (_plot, ticks) => ticks.map(tick), size: 56, space: 36 }),
  ],
  series: [{ label: "Step", value: (_plot, at) => (at === null ? "–" : number(at)) }, ...lines.map(series)],
});

/** The legend's swatches, which unlike uPlot's own follow the theme; the thin lines go without a name. */
const mark = (legend, { place, thin }) =>
  legend.classList.add(...(thin ? ["unlisted"] : [`line-${place % COLOURS}`, `dash-${place % DASHES.length}`]));

const drawn = (lines) => columns(lines.map(({ curve }) => curve));

export class Overlay {
  constructor(box, title) {
    this.section = document.createElement("section");
    this.section.className = "chart";
    if (title) {
      const heading = document.createElement("h3");
      heading.textContent = title;
      this.section.append(heading);
    }
    box.append(this.section);
    new ResizeObserver(() => this.plot?.setSize({ width: this.section.clientWidth, height: HEIGHT })).observe(
      this.section,
    );
    onTheme(() => this.plot?.redraw(false));
  }

  /** Draw these lines over that many steps; a plot for other lines is made anew. */
  show(lines, steps) {
    const shape = JSON.stringify([steps, lines.map(({ label, place }) => [label, place])]);
    if (shape === this.shape) {
      this.plot.setData(drawn(lines));
      return;
    }
    this.plot?.destroy();
    this.plot = new uPlot(options(lines, steps, this.section.clientWidth), drawn(lines), this.section);
    const [, ...legends] = this.plot.root.querySelectorAll(".u-series");
    lines.forEach((line, index) => mark(legends[index], line));
    this.shape = shape;
  }
}

/** Call `refresh` now, and whenever the polled part of the page says that there are newer evaluations. */
export const followEvaluations = async (refresh) => {
  const at = () => document.querySelector("[data-evaluated]").dataset.evaluated;
  let shown = null;
  const follow = async () => {
    const now = at();
    if (now === shown) return;
    try {
      await refresh();
      shown = now;
    } catch {
      // the page itself says when nobody answers; the next poll tries again
    }
  };
  document.addEventListener("htmx:after:swap", follow);
  await follow();
};

export const asked = async (address) => {
  const reply = await fetch(address);
  if (!reply.ok) throw new Error(`${address}: ${reply.status}`);
  return reply.json();
};
