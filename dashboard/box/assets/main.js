// The page: frames come in, the arena is drawn, buttons and keys go out. Nothing is drawn more often than the screen shows.

import { draw } from "./draw.js";
import { fromGrid, unpacked } from "./floor.js";
import { kindNames } from "./kinds.js";
import { ask, connect } from "./link.js";
import * as mix from "./mix.js";
import * as panel from "./panel.js";
import * as past from "./past.js";
import { apply, go, save } from "./setup.js";
import { about, isDrafted, phase, state, takeTruth, titled, wanted } from "./state.js";
import { readTheme } from "./theme.js";
import { install, setRobots, starts } from "./tools.js";
import { View } from "./view.js";
import { view as show } from "./viewer.js";
import { count, doing } from "./words.js";

const $ = (id) => document.getElementById(id);
const canvas = $("floor"), context = canvas.getContext("2d"), view = new View();
const HINTS = {
  look: "click a robot to look inside; drag to move, wheel to zoom",
  start: "click where the next robot starts; drag for its heading",
  target: "click: target 1, 2, 3, ...; drag one to move it",
  wall: "drag a wall from corner to corner",
  erase: "drag over walls, or click a target or a start",
  send: "click where it is to go",
  past: "the past: click a robot; left and right go a tick, with shift a second",
};
const SAID = 6000; // ms that a sentence stays

// --- frames ---

let maps = 0; // that have come
let drawing = ""; // the newest of them

const TAKE = {
  "box/hello": (hello) => {
    state.hello = hello;
    $("scenario").replaceChildren(...Object.entries(hello.scenarios).map(([name, about]) => {
      const option = new Option(name, name);
      option.title = about;
      return option;
    }));
  },
  "box/overview": (overview) => (state.overview = overview),
  "box/rules": (rules) => (state.rules = rules),
  "box/joint": (joint) => (state.joint = joint),
  "box/learned": (learned) => (state.learned = learned),
  "fleet/setup": (setup) => (state.setup = setup),
  "world/clock": (clock) => (state.clock = clock),
  "world/truth": takeTruth,
  "box/trails": (trails) => (state.trails = new Map(Object.entries(trails))), // of a past moment
  "world/events": ({ events }) => {
    state.events = events;
    panel.writeEvents();
  },
  "robot/{robot}/plan": (plans) => (state.plans = new Map(plans.map(({ robot, points }) => [robot, points]))),
  "world/map": async (map) => {
    const before = state.floor, told = JSON.stringify(map);
    if (told === drawing) return; // a moment of the past has the floor that is drawn already
    drawing = told;
    const mine = ++maps, floor = await unpacked(map);
    if (mine !== maps) return; // a newer one has come meanwhile
    state.floor = floor;
    if (!before || before.rows !== state.floor.rows || before.columns !== state.floor.columns) whole();
    redraw();
  },
};

connect(
  (key, message) => {
    if (!past.holds(key, message, page)) page.take(key, message);
    redraw();
  },
  (up) => {
    state.connected = up;
    redraw();
  },
  () => state.now.phase !== "over",
);

// --- drawing ---

let due = false;

function redraw() {
  if (due) return;
  due = true;
  requestAnimationFrame(() => {
    due = false;
    draw(context, view);
    past.refresh(page);
    panel.refresh(page);
    inputs();
  });
}

function resize() {
  const { width, height } = canvas.parentElement.getBoundingClientRect();
  [view.width, view.height] = [width, height];
  canvas.width = Math.round(width * devicePixelRatio);
  canvas.height = Math.round(height * devicePixelRatio);
  if (view.fitted) whole();
  redraw();
}

function whole() {
  if (!state.floor) return;
  const { rows, columns, resolution } = state.floor, w = columns * resolution, h = rows * resolution;
  const ring = [[0, 0], [w, 0], [w, h], [0, h]].map((corner) => fromGrid(state.floor, corner));
  const [xs, ys] = [0, 1].map((axis) => ring.map((corner) => corner[axis]));
  view.fit([Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)]);
}

/** Let the fields show what is set up, where the user is not writing in them. */
function inputs() {
  const active = document.activeElement, robots = state.draft.starts?.length ?? wanted("robots") ?? state.clock?.robots.length;
  if (active !== $("robots") && robots) $("robots").value = robots;
  mix.refresh(page);
  if (active !== $("speed")) $("speed").value = wanted("speed") ?? 0.4;
  const each = wanted("speed") === null && kindNames(state.floor).length > 0;
  $("speed_reading").textContent = each ? "each its own" : `${Math.round(100 * $("speed").value)} %`;
  const name = wanted("scenario") ?? state.floor?.settings.name;
  if (active !== $("scenario") && name && $("scenario").value !== name) {
    if (![...$("scenario").options].some((option) => option.value === name)) $("scenario").add(new Option(name, name));
    $("scenario").value = name;
  }
  for (const field of document.querySelectorAll(".tools > button, .field > :is(input, select)")) field.disabled = Boolean(state.past);
  const hint = HINTS[state.past ? "past" : state.tool];
  const text = isDrafted() ? `drawn, not driven yet: press go. ${hint}` : hint;
  if ($("hint").textContent !== text) $("hint").textContent = text;
  document.documentElement.classList.toggle("drafted", isDrafted());
}

// --- what the user does ---

let silence = 0;

function say(text, wrong = false) {
  $("said").textContent = text;
  $("said").className = `said shown${wrong ? " wrong" : ""}`;
  clearTimeout(silence);
  silence = setTimeout(() => ($("said").className = "said"), SAID);
}

const page = {
  redraw,
  say,
  /** Take in a frame, of now or of the moment that is shown. */
  take(key, message) {
    TAKE[key]?.(message);
  },
  /** Wait for a request, and say what came of it: the answer's text, or the sentence of a refusal. */
  async carry(request) {
    try {
      const text = await request;
      if (text) say(text);
    } catch (fault) {
      say(fault.message, true);
    }
    redraw();
  },
  choose(robot) {
    panel.choose(robot);
    past.again(page);
    if (!robot && state.tool === "send") page.use("look");
    redraw();
  },
  use(wished) {
    const tool = state.past ? "look" : wished;
    state.tool = tool;
    for (const button of document.querySelectorAll("[data-tool]")) {
      button.setAttribute("aria-pressed", String(button.dataset.tool === tool));
    }
    redraw();
  },
};

/** Do what commands the fleet, but not while the past is shown. */
const command = (what) => () => (state.past ? say("this is the past: go back to live first", true) : what());
const act = (what) => ask("/action", { do: what }).then((answer) => answer.text);
const press = {
  go: command(() => page.carry(go())),
  pause: command(() => page.carry(act(phase() === "paused" ? "resume" : "pause"))),
  restart: command(() => page.carry(act("restart"))),
  save: command(() => page.carry(save())),
  closer: () => view.zoom(1.3),
  farther: () => view.zoom(1 / 1.3),
  whole,
  stop: command(() => {
    const button = $("stop");
    if (button.dataset.sure) return page.carry(act("stop"));
    button.dataset.sure = "yes";
    button.textContent = "really stop?";
    setTimeout(() => {
      delete button.dataset.sure;
      button.textContent = "stop";
    }, 3000);
  }),
};
for (const [id, what] of Object.entries(press)) {
  $(id).addEventListener("click", () => {
    what();
    redraw();
  });
}
for (const button of document.querySelectorAll("[data-tool]")) {
  button.addEventListener("click", () => page.use(button.dataset.tool));
}
$("robots").addEventListener("change", () => {
  page.carry((async () => {
    const wished = Math.round(Number($("robots").value));
    if (!(wished >= 1 && wished <= 1000)) throw new Error(`robots: expected 1 to 1000, got ${$("robots").value || "nothing"}`);
    if (wished !== (state.draft.starts ? starts().length : wanted("robots"))) setRobots(wished);
  })());
});
$("robots").addEventListener("keydown", (event) => {
  if (event.key === "Enter") $("robots").blur(); // it is asked for, and the keys steer the page again
});
$("speed").addEventListener("input", () => {
  state.draft.speed = Number($("speed").value);
  if (state.draft.speed === state.setup?.speed) delete state.draft.speed;
  redraw();
});
$("scenario").addEventListener("change", () => {
  state.draft = { scenario: $("scenario").value };
  $("scenario").blur();
  const asked = apply().then(() => `${wanted("scenario")}: press go`);
  page.carry(asked.catch((fault) => {
    state.draft = {};
    throw fault;
  }));
});
$("layers").replaceChildren(...Object.keys(state.layers).map((name) => {
  const label = document.createElement("label"), box = document.createElement("input");
  box.type = "checkbox";
  box.checked = state.layers[name];
  box.onchange = () => {
    state.layers[name] = box.checked;
    redraw();
  };
  label.append(box, name);
  return label;
}));

for (const name of ["floor", "rerun"]) $(`tab_${name}`).addEventListener("click", () => page.carry(show(name)));
show("floor");

const TOOLS = ["look", "start", "target", "wall", "erase"];
const PAN = { ArrowLeft: [60, 0], ArrowRight: [-60, 0], ArrowUp: [0, 60], ArrowDown: [0, -60] };

addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || ["INPUT", "SELECT"].includes(event.target.tagName)) return;
  const key = event.key;
  if (past.pressed(event, page)) null; // it has moved in time
  else if (PAN[key]) view.pan(...PAN[key]);
  else if ("12345".includes(key)) page.use(TOOLS[key - 1]);
  else if (key === "Escape") page.choose(null);
  else if (key === "n" || key === "N") next(key === "n" ? 1 : -1);
  else if (key === " " && event.target.tagName !== "BUTTON") press.pause();
  else if (key === "g") press.go();
  else if (key === "r") press.restart();
  else if (key === "s") press.save();
  else if (key === "+" || key === "=") press.closer();
  else if (key === "-") press.farther();
  else if (key === "0") whole();
  else return;
  event.preventDefault();
  redraw();
});

/** Look at the next robot, or the one before. */
function next(step) {
  const robots = state.clock?.robots ?? [], at = robots.indexOf(state.selected);
  if (robots.length) page.choose(robots[(at + step + robots.length) % robots.length]);
}

// words for who does not see the arena
setInterval(() => {
  const robots = state.overview?.robots ?? [], told = robots.slice(0, 8);
  const text = `the floor with ${count(robots.length, "robot")}: ` + told.map((row) => `${titled(row.robot)} ${doing(row, about(row.robot))}`).join(". ");
  canvas.setAttribute("aria-label", text);
}, 3000);

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  readTheme();
  redraw();
});
new ResizeObserver(resize).observe(canvas.parentElement);
readTheme();
install(canvas, view, page);
past.install(page);
page.use("look");
resize();
