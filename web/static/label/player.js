// Two clips in lockstep: one clock chooses one frame for both canvases.

const HOLD_SECONDS = 0.4;

/** The frame on show at a time: the last one that has appeared. */
export function frameAt(times, seconds) {
  let frame = 0;
  while (frame + 1 < times.length && times[frame + 1] <= seconds) frame += 1;
  return frame;
}

export class Player {
  #start = null;
  #request = 0;
  #drawn = -1;
  #onFirstFrame = null;
  #paused = false;
  rate = 1;
  /** @type {import("./pair.js").Pair | null} */
  pair = null;

  /** @param {HTMLCanvasElement} left @param {HTMLCanvasElement} right @param {HTMLElement} position */
  constructor(left, right, position) {
    this.canvases = { left, right };
    this.position = position;
  }

  /** Play a pair from its start; `onFirstFrame` is called once that is drawn. */
  show(pair, onFirstFrame) {
    this.pair = pair;
    this.#onFirstFrame = onFirstFrame;
    for (const side of ["left", "right"]) fit(this.canvases[side], pair[side]);
    this.replay();
  }

  replay() {
    this.#start = null;
    this.#drawn = -1;
    this.#run();
  }

  clear() {
    this.pair = null;
    cancelAnimationFrame(this.#request);
    for (const canvas of Object.values(this.canvases)) canvas.getContext("2d").clearRect(0, 0, canvas.width, canvas.height);
  }

  pause() {
    this.#paused = true;
    cancelAnimationFrame(this.#request);
  }

  /** Go on from the start: nobody remembers where a clip stood when they looked away. */
  resume() {
    this.#paused = false;
    if (this.pair) this.replay();
  }

  /** Play faster or slower from where the clips are. */
  setRate(rate) {
    const now = performance.now();
    if (this.#start !== null) this.#start = now - ((now - this.#start) * this.rate) / rate;
    this.rate = rate;
  }

  #run() {
    cancelAnimationFrame(this.#request);
    if (!this.#paused) this.#request = requestAnimationFrame((now) => this.#tick(now));
  }

  #tick(now) {
    this.#start ??= now;
    const { duration, times } = this.pair.left;
    const elapsed = (Math.max(0, now - this.#start) / 1000) * this.rate;
    const seconds = Math.min(elapsed % (duration + HOLD_SECONDS), duration);
    this.#draw(frameAt(times, seconds), seconds / duration);
    this.#run();
  }

  /** Only a new frame changes anything on the page: the training may need the processor more. */
  #draw(frame, share) {
    if (frame === this.#drawn) return;
    this.#drawn = frame;
    for (const side of ["left", "right"]) drawFrame(this.canvases[side], this.pair.sheets[side], this.pair[side], frame);
    this.position.style.transform = `scaleX(${frame + 1 === this.pair.left.frames ? 1 : share})`;
    this.#onFirstFrame?.();
    this.#onFirstFrame = null;
  }
}

function fit(canvas, clip) {
  canvas.dataset.clip = clip.url;
  if (canvas.width !== clip.width) canvas.width = clip.width;
  if (canvas.height !== clip.height) canvas.height = clip.height;
  canvas.parentElement.parentElement.style.setProperty("--shape", `${clip.width / clip.height}`);
}

function drawFrame(canvas, sheet, clip, frame) {
  const { width, height, columns } = clip;
  const shown = Math.min(frame, clip.frames - 1);
  const x = (shown % columns) * width;
  const y = Math.floor(shown / columns) * height;
  canvas.getContext("2d").drawImage(sheet, x, y, width, height, 0, 0, width, height);
  canvas.dataset.frame = `${shown}`;
}
