// An experiment's curves: a chart for each task, in it each method's mean over seeds and the seeds themselves.
import { Overlay, asked, followEvaluations } from "./overlay.js";

const box = document.querySelector("[data-overlays]");
const overlays = new Map();

const curve = ({ steps, values, means }) => new Map(steps.map((step, index) => [step, (values ?? means)[index]]));

const linesOf = ({ methods, results, runs }, task) =>
  results
    .filter((result) => result.task === task && result.evaluated)
    .flatMap((result) => {
      const place = methods.indexOf(result.method);
      const seeds = runs.filter((run) => run.task === task && run.method === result.method && run.curve.steps.length);
      const thin = seeds.length > 1 ? seeds : [];
      return [
        ...thin.map((run) => ({ label: run.id, place, curve: curve(run.curve), thin: true })),
        { label: seeds.length > 1 ? `${result.method}, ${seeds.length} seeds` : result.method, place, curve: curve(result.curve) },
      ];
    });

const refresh = async () => {
  const found = await asked(box.dataset.source);
  for (const task of found.tasks) {
    const lines = linesOf(found, task.name);
    if (!lines.length) continue;
    const steps = Math.max(...found.runs.filter((run) => run.task === task.name).map((run) => run.total_steps));
    if (!overlays.has(task.name)) overlays.set(task.name, new Overlay(box, task.title));
    overlays.get(task.name).show(lines, steps);
  }
  box.querySelector("[data-overlays-none]").hidden = overlays.size > 0;
};

await followEvaluations(refresh);
