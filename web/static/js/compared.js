// The evaluations of the chosen runs in one chart.
import { Overlay, asked, followEvaluations } from "./overlay.js";

const box = document.querySelector("[data-overlays]");
const { measure, steps } = box.dataset;
const runs = [...box.querySelectorAll("[data-run]")];
let overlay = null;

const valueOf = (evaluation) => (measure === "return" ? evaluation.mean_return : evaluation.measures[measure]);

const lineOf = async (run, place) => {
  const found = await asked(`/api/runs/${run.dataset.run}/evaluations`);
  const measured = found.filter((evaluation) => typeof valueOf(evaluation) === "number");
  return { label: run.value, place, curve: new Map(measured.map((each) => [each.step, valueOf(each)])) };
};

const refresh = async () => {
  const lines = (await Promise.all(runs.map(lineOf))).filter(({ curve }) => curve.size);
  if (!lines.length) return;
  overlay ??= new Overlay(box);
  overlay.show(lines, Number(steps));
  box.querySelector("[data-overlays-none]").hidden = true;
};

await followEvaluations(refresh);
