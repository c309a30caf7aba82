// An experiment's curves: a chart for each task, in it each method's mean over seeds and the seeds themselves.
import { number } from "./numbers.js";
import { Overlay, asked, followEvaluations } from "./overlay.js";

const box = document.querySelector("[data-overlays]");
const overlays = new Map();
const MANY = 4; // times the fewest steps of the methods that there are lines of

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

/** A method with many times the others' steps: a line where it ended, since its curve would leave them no room. */
const asymptoteOf = ({ methods }, { method, curve: means }, steps) => {
  const end = means.means.at(-1);
  const label = `${method}, after ${number(means.steps.at(-1))} steps`;
  return { label, place: methods.indexOf(method), curve: new Map([[0, end], [steps, end]]) };
};

/** How many steps a method's runs are to take on a task; one that was given more of them counts like the others. */
const plannedSteps = ({ runs }, { task, method }) =>
  Math.min(...runs.filter((run) => run.task === task && run.method === method).map((run) => run.total_steps));

const draw = (found, task) => {
  const results = found.results.filter((result) => result.task === task.name && result.evaluated);
  if (!results.length) return;
  const planned = new Map(results.map((result) => [result, plannedSteps(found, result)]));
  const fewest = Math.min(...planned.values());
  const steps = Math.max(...[...planned.values()].filter((each) => each < MANY * fewest));
  const lines = (result) =>
    planned.get(result) > steps && result.curve.steps.length ? [asymptoteOf(found, result, steps)] : linesOf(found, result);
  if (!overlays.has(task.name)) overlays.set(task.name, new Overlay(box, task.title));
  overlays.get(task.name).show(results.flatMap(lines), steps);
};

const refresh = async () => {
  const found = await asked(box.dataset.source);
  for (const task of found.tasks) draw(found, task);
  box.querySelector("[data-overlays-none]").hidden = overlays.size > 0;
};

await followEvaluations(refresh);
