// Why, and back in time: both from the tape of the run. The frames of a past moment go the way of live ones, which wait
// meanwhile; so all that is drawn and written of now is drawn and written of then.

import { ask } from "./link.js";
import { body, rate, row, state } from "./state.js";

const $ = (id) => document.getElementById(id);
const ALWAYS = new Set(["box/hello", "fleet/setup"]); // frames that belong to no moment
const WAITS = new Set(["give_way", "blocked", "stopped"]);
const AGAIN = 2000; // ms, at least, between two questions about now that nobody has clicked for
const REST = 4; // times as long as an answer took, the tape is left alone before such a question
const live = new Map(); // the newest live frame of each kind

let dragged = false; // the slider is held
let wished = null; // the tick that was asked for last
let asked = { about: "", again: 0 }; // what the last question why was about, and when another may be asked [ms]

/** Keep a live frame. Return true if it has to wait, because the past is shown. */
export function holds(key, message, page) {
  const { now } = state;
  if (key === "world/clock") Object.assign(now, message.run === now.run ? {} : { run: message.run, tick: 0 }, { phase: message.phase });
  if ((key === "world/clock" || key === "world/truth") && message.run === now.run) now.tick = Math.max(now.tick, message.tick);
  if (state.past && state.past.run !== now.run) back(page); // another run has begun
  if (ALWAYS.has(key)) return false;
  live.set(key, message);
  return Boolean(state.past);
}

/** Return a function that does one thing at a time; of what is asked for meanwhile, it does the last. */
function newest(work) {
  let busy = false, next = null;
  return async function one(...given) {
    if (busy) return void (next = given);
    busy = true;
    try {
      await work(...given);
    } finally {
      busy = false;
      if (next) {
        const last = next;
        next = null;
        one(...last);
      }
    }
  };
}

// --- back in time ---

const last = () => Math.max(0, state.now.tick - 1); // the newest tick that is certainly on the tape

/** Show a tick of the run; the newest is now. */
function seek(tick, page) {
  wished = Math.max(0, Math.round(tick));
  if (wished >= last()) return back(page);
  show(page, wished);
}

const show = newest(async (page, tick) => {
  if (wished !== tick) return; // back to now, or further
  const robot = state.selected, { run } = state.past ?? state.now;
  let told;
  try {
    told = await ask(`/past${named(robot)}`, { at: tick / rate(), run });
  } catch (fault) {
    wished = state.past?.tick ?? null;
    return page.say(fault.message, true);
  }
  if (wished === null || run !== state.now.run) return; // back to now meanwhile
  const begins = !state.past;
  state.past = { run, tick, doubt: told.doubt };
  if (begins) page.use("look");
  for (const { key, message } of told.frames) page.take(key, message);
  page.redraw();
});

/** Show the run as it is now. */
function back(page) {
  wished = null;
  if (!state.past) return;
  state.past = state.why = null;
  state.trails = new Map();
  for (const [key, message] of live) page.take(key, message);
  page.redraw();
}

/** Show the moment again, and ask again why: a robot was selected. */
export function again(page) {
  asked.about = "";
  if (state.past) seek(wished, page);
}

// --- why ---

/** Ask why the selected robot does what it does at the moment that is shown. */
export function why(page) {
  asked = { about: subject(), again: Infinity };
  inquire(page, state.selected, state.past && { at: state.past.tick / rate(), run: state.past.run });
}

const inquire = newest(async (page, robot, moment) => {
  const began = performance.now();
  let told;
  try {
    told = await ask(`/why${named(robot)}`, moment ?? {});
  } catch (fault) {
    told = { text: fault.message, doubt: null, wrong: true };
  }
  asked.again = performance.now() + Math.max(AGAIN, REST * (performance.now() - began));
  if (robot !== state.selected || (moment?.at ?? null) !== (state.past && state.past.tick / rate())) return; // too late
  state.why = { robot, ...told };
  page.redraw();
});

/** What a question why is about: another answer is to be expected if it changes. */
function subject() {
  const robot = state.selected, { past } = state;
  return `${robot} ${past ? `${past.run} ${past.tick}` : `${row(robot)?.activity} ${body(robot)?.waits}`}`;
}

/** Ask by itself why the selected robot waits: in the past for each tick, now if that has changed, and not often. */
function attend(page) {
  const seen = body(state.selected), waits = WAITS.has(seen?.activity) || seen?.waits.length, about = subject();
  if (!state.selected || !state.hello?.tape || about === asked.about) return;
  if (state.past && wished !== state.past.tick) return; // it will not be shown for long
  if (!waits) {
    asked.about = "";
    state.why = null;
  } else if (state.past || state.why?.robot !== state.selected || performance.now() > asked.again) {
    why(page);
  }
}

const named = (robot) => (robot ? `?robot=${encodeURIComponent(robot)}` : "");

// --- the slider ---

/** Make the slider and its buttons work; `page` has take(key, message), say(text, wrong), use(tool) and redraw(). */
export function install(page) {
  const when = $("when");
  when.addEventListener("pointerdown", () => (dragged = true));
  when.addEventListener("pointerup", () => {
    dragged = false;
    when.blur(); // the keys steer the page again
  });
  when.addEventListener("input", () => seek(Number(when.value), page));
  when.addEventListener("keydown", (event) => {
    if (step(event, page)) event.preventDefault();
  });
  $("earlier").addEventListener("click", (event) => move(event.shiftKey ? -rate() : -1, page));
  $("later").addEventListener("click", (event) => move(event.shiftKey ? rate() : 1, page));
  $("live").addEventListener("click", () => back(page));
}

function move(ticks, page) {
  seek((wished ?? last()) + ticks, page);
}

function step({ key, shiftKey }, page) {
  const side = { ArrowLeft: -1, ArrowRight: 1 }[key];
  if (side) move(side * (shiftKey ? rate() : 1), page);
  return Boolean(side);
}

/** Move in time by a key while the past is shown; return false if it is none of these keys. */
export function pressed(event, page) {
  if (!state.past) return false;
  if (event.key.toLowerCase() !== "l") return step(event, page);
  back(page);
  return true;
}

/** Return the options of `swarm why` that name the moment. */
export function moment() {
  return state.past ? `--at ${(state.past.tick / rate()).toFixed(2)} --run ${state.past.run}` : "";
}

/** Write anew what may have changed, and ask why the selected robot waits. */
export function refresh(page) {
  const { past, hello } = state, when = $("when"), newestTick = last();
  const lacks = !hello || !state.connected ? "the box does not answer" : !hello.tape ? "no way back in time: this run has no tape on this machine" : newestTick ? "" : "nothing is past: the run has not begun";
  when.disabled = Boolean(lacks);
  $("earlier").disabled = when.disabled;
  $("later").disabled = !past;
  if (!dragged) {
    when.max = newestTick;
    when.value = wished ?? newestTick;
  }
  const told = past ? `${(past.tick / rate()).toFixed(2)} s, past${past.doubt ? ", in doubt" : ""}` : lacks || "live";
  if ($("reading").textContent !== told) $("reading").textContent = told;
  when.setAttribute("aria-valuetext", told);
  $("reading").title = past?.doubt ?? "";
  $("live").hidden = !past;
  document.documentElement.classList.toggle("past", Boolean(past));
  attend(page);
}
