// What every chart shares: colours of the page's theme, axes, redrawing when the theme changes.
const probe = document.createElement("span");
probe.hidden = true;
document.body.append(probe);

/** A canvas knows no custom properties: an element resolves them, in the theme of the moment. */
export const colour = (name) => {
  probe.style.color = `var(--${name})`;
  return getComputedStyle(probe).color;
};

export const axis = (more) => ({
  stroke: () => colour("ink-soft"),
  grid: { stroke: () => colour("line"), width: 1 },
  ticks: { show: false },
  font: "12px system-ui, sans-serif",
  ...more,
});

/** Columns for uPlot: the steps at which any was measured, then each one's values there (Maps of step to value). */
export const columns = (curves) => {
  const steps = [...new Set(curves.flatMap((curve) => [...curve.keys()]))].sort((a, b) => a - b);
  return [steps, ...curves.map((curve) => steps.map((step) => curve.get(step)))];
};

/** Call with every change of the theme. */
export const onTheme = (redraw) => {
  document.addEventListener("theme:change", redraw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
};
