// An experiment's curves: a chart for each task, in it each method's mean over seeds and the seeds themselves.
import { Overlay, asked, followEvaluations } from "./overlay.js";

const box = document.querySelector("[data-overlays]");
const overlays = new Map();

const curve = ({ steps, values, means }) => new Map(steps.map((step, index) => [step, (values ?? means)[index]]));

/** A method's mean, named after it, and under it its seeds, also those that are not counted yet. */
const linesOf = ({ methods, runs }, { task, method, evaluated, curve: means }) => {
  const place = methods.indexOf(method);
  const seeds = runs.filter((run) => run.task === task && run.method === method && run.curve.steps.length);
  const mean = { label: method, place, curve: curve(means) };
  if (seeds.length < 2) return [mean];
  const thin = seeds.map((run) => ({ label: run.id, place, curve: curve(run.curve), thin: true }));
  return [...thin, { ...mean, label: `${method}, ${evaluated} ${evaluated === 1 ? "seed" : "seeds"}` }];
};

const draw = (found, task) => {
  const results = found.results.filter((result) => result.task === task.name && result.evaluated);
  if (!results.length) return;
  const steps = Math.max(...found.runs.filter((run) => run.task === task.name).map((run) => run.total_steps));
  if (!overlays.has(task.name)) overlays.set(task.name, new Overlay(box, task.title));
  overlays.get(task.name).show(results.flatMap((result) => linesOf(found, result)), steps);
};

const refresh = async () => {
  const found = await asked(box.dataset.source);
  for (const task of found.tasks) draw(found, task);
  box.querySelector("[data-overlays-none]").hidden = overlays.size > 0;
};

await followEvaluations(refresh);
