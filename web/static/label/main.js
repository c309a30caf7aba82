// The labelling page: puts its parts together and lets them act on each other.

import { Api, Refusal } from "./api.js";
import { onClick, speedSwitch } from "./buttons.js";
import { Fragment } from "./fragments.js";
import { keysDialog } from "./help.js";
import { History } from "./history.js";
import { Keeper } from "./keeper.js";
import { listenToKeys } from "./keys.js";
import { labellerForm } from "./labeller.js";
import { Labelling } from "./labelling.js";
import { nod } from "./motion.js";
import { Outbox, unsentOf } from "./outbox.js";
import { Player } from "./player.js";
import { Pace, progressText, unsentCount } from "./progress.js";
import { PairQueue } from "./queue.js";
import { arrivalSound } from "./sound.js";
import { Kept, KeptItems } from "./storage.js";
import { badge } from "./title.js";
import { unreachedSentence, View } from "./view.js";

const SAID = { left: "Left preferred", right: "Right preferred", equal: "Equal", skip: "Cannot tell" };

const root = document.querySelector("[data-label]");
const { run, life } = root.dataset;
const one = (selector) => document.querySelector(selector);

const api = new Api(run, life);
const view = new View(root);
const queue = new PairQueue();
const history = new History(new Kept(sessionStorage, `pebble:history:${life}`, []));
const outbox = new Outbox(new KeptItems(localStorage, unsentOf(life)), send);
const keeper = new Keeper({ api, queue, outbox });
const player = new Player(one("#left"), one("#right"), one("[data-position]"));
const pace = new Pace(new Kept(sessionStorage, "pebble:pace", []));
const labelling = new Labelling({ queue, outbox, history, player });
const taught = new Fragment(one("[data-taught]"), `/runs/${encodeURIComponent(run)}/label/taught`);
const summary = new Fragment(one("[data-summary]"), `/runs/${encodeURIComponent(run)}/label/summary`);
const beep = arrivalSound(one("[data-sound]"), new Kept(localStorage, "pebble:sound", false));

const named = new Kept(localStorage, "pebble:named", "");

let state = null;
let nothingWaits = false;
/** What the keeper met instead of a state: `{error}` where it was refused, `{signedOut}` where it got no answer. */
let failure = null;

async function send(item) {
  const { id, seen } = item;
  if (item.kind === "retract") return takeBack(item.answer_id, id, seen);
  const { pressed, shown_at, goal } = item;
  const lease_id = item.lease_id ?? (await leaseAfter(item));
  const judged = { life, seen, pressed, shown_at, goal_card_version: goal };
  return api.answer({ answer_id: id, lease_id, ...judged, count: keeper.wanted });
}

function takeBack(answerId, retractionId, seen) {
  return api.retract(answerId, { retraction_id: retractionId, life, seen, count: keeper.wanted });
}

/** The lease that a retraction brought, perhaps to another tab: sent again, it says so and changes nothing. */
async function leaseAfter({ retracted, lease_of, seen }) {
  const { lease } = await takeBack(retracted, lease_of, seen);
  if (!lease) throw new Refusal("its pair was not lent again");
  return lease.lease_id;
}

/** Tabs of one browser share what is unsent, and one of them may be closed. */
function sendWhatAnotherTabLeft() {
  if (document.hidden || !outbox.items.length) return;
  queue.exclude(leasesOf(outbox.items));
  view.beginSaving();
  outbox.drain();
}

function leasesOf(items) {
  return items.map((item) => item.lease_id).filter((id) => id != null);
}

function showProgress() {
  if (!state) return;
  const given = Math.max(0, state.given + unsentCount(outbox.items));
  view.setProgress(progressText({ ...state, given }, pace.seconds));
  view.setUndo(history.length > 0);
}

function showHead() {
  const head = queue.head;
  if (head?.ready) {
    if (head !== player.pair) labelling.show(head);
    view.showPair(head.queryId);
    return;
  }
  player.clear();
  if (head) view.showWait();
  else if (failure?.error) view.showEmpty("refused", failure.error.message);
  else if (failure || outbox.failures) showUnreached();
  else if (state?.message) showReason(state.message);
  else if (queue.onlyBroken) view.showEmpty("broken", "The pairs that are left cannot be shown. Reload the page to try again.");
  else view.showWait();
}

function showUnreached() {
  const signedOut = failure?.signedOut || outbox.signedOut;
  view.showEmpty("unreached", unreachedSentence(outbox.items.length, signedOut));
}

function showReason({ kind, sentence }) {
  view.showEmpty(kind, sentence);
  if (kind === "finished" || kind === "answered") summary.update(state.taught);
}

function attend() {
  const waiting = Math.max(queue.length, document.hidden ? (state?.available ?? 0) : 0);
  badge(waiting);
  if (waiting && nothingWaits) {
    beep();
    view.announce(waiting === 1 ? "A pair is ready." : `${waiting} pairs are ready.`);
  }
  nothingWaits = waiting === 0;
}

labelling.addEventListener("answered", ({ detail }) => {
  nod(view.clips, detail.pressed);
  pace.add(detail.milliseconds);
  view.beginSaving();
  showProgress();
  view.announce(`${SAID[detail.pressed]}. ${view.progress.textContent.split(" · ")[0]}.`);
});
labelling.addEventListener("undone", ({ detail }) => {
  showProgress();
  view.announce(`Taken back: ${SAID[detail.pressed]}.`);
});

queue.addEventListener("head", showHead);
queue.addEventListener("broken", ({ detail }) => view.say(`A pair was passed over: ${detail}.`));

outbox.addEventListener("change", () => {
  view.setSaved(outbox.items.length, { failing: outbox.failures > 0, signedOut: outbox.signedOut });
  showProgress();
  if (outbox.failures && !queue.length) showHead();
});
outbox.addEventListener("sent", ({ detail: { item, reply } }) => {
  if (item.kind === "retract" && reply.lease) labelling.resolve(item.id, reply.lease.lease_id);
  keeper.heard(reply);
});
outbox.addEventListener("refused", ({ detail: { item, error } }) => {
  labelling.refuse(item);
  view.say(`One pair was passed over: ${error.message}.`);
  keeper.poke();
});

keeper.addEventListener("state", ({ detail }) => {
  state = detail;
  labelling.goal = state.goal?.version;
  view.setGoal(state.goal);
  if (failure) outbox.retryNow();
  failure = null;
  sendWhatAnotherTabLeft();
  showProgress();
  showHead();
  attend();
  taught.update(state.taught);
  if (!outbox.items.length) view.setSaved(0, { failing: false });
});
keeper.addEventListener("refused", ({ detail }) => {
  failure = detail;
  queue.drop(() => true);
});
keeper.addEventListener("unreached", ({ detail }) => {
  failure = detail;
  if (outbox.items.length === 0) view.setUnreached(detail.signedOut);
  if (!queue.length) showHead();
});

const act = {
  canPress: () => root.dataset.mode === "pair",
  press: (side, at) => labelling.press(side, at),
  undo: () => labelling.undo() || view.say("There is nothing to take back."),
  replay: () => player.pair && player.replay(),
  help: keysDialog(one("[data-keys]"), document.querySelectorAll("[data-open-keys]")),
};

listenToKeys(act);
// The second click of a double click was meant for the pair before.
const clicked = ({ dataset }, event) => event.detail > 1 || act.press(dataset.press, event.timeStamp);
for (const button of view.answers) onClick(button, (event) => clicked(button, event));
onClick(view.undo, act.undo);
onClick(one("[data-replay]"), act.replay);

speedSwitch(one("[data-speed]"), new Kept(localStorage, "pebble:rate", 1), (rate) => player.setRate(rate));

labellerForm(one("[data-labeller]"), {
  say: (text) => view.say(text),
  rename: async (name) => {
    if (outbox.items.length) throw new Error("Your last answers are still being sent; try again in a moment.");
    await api.beNamed(name);
    history.clear();
    named.set(name);
    location.reload();
  },
});
// Other tabs hold pairs that were lent to somebody who is not labelling any more.
addEventListener("storage", ({ key }) => key === named.key && location.reload());

document.addEventListener("visibilitychange", () => (document.hidden ? player.pause() : player.resume()));
addEventListener("focus", attend);
addEventListener("blur", attend);
if (document.hidden) player.pause();

queue.exclude(leasesOf(outbox.items));
view.showWait();
if (outbox.items.length) view.beginSaving();
view.setUndo(history.length > 0);
outbox.drain();
keeper.poke();
