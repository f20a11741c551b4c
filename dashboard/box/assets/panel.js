// The words beside the arena: totals, a bar for each robot, the selected robot, events.

import { kindOf, radiusOfKind, sensorsOf, topSpeedOfKind } from "./kinds.js";
import { ask, select } from "./link.js";
import { moment, why } from "./past.js";
import { about, body, colour, isDrafted, phase, row, shape, state, titled } from "./state.js";
import { doing, nth, ofKind, quoted, ruleInWords, said, seconds } from "./words.js";

const $ = (id) => document.getElementById(id);
const MANY = 12; // robots; of more, the bars stand in two columns
const SHORT = { "gives way": "waits" }; // what two columns have room for, and a row with a turn
const RULES = 5; // rules shown, the strongest
const EVENTS = 60; // events shown, the newest

function element(tag, className = "", text = "") {
  const made = document.createElement(tag);
  made.className = className;
  made.textContent = text;
  return made;
}

function set(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

/** Write everything anew that may have changed; `page` has choose(robot), carry(promise) and use(tool). */
export function refresh(page) {
  head();
  rows(page);
  one(page);
  tape(page);
}

function head() {
  const told = state.overview, now = phase();
  const finished = now === "over" && isDone();
  document.documentElement.dataset.phase = state.past ? "past" : finished ? "finished" : state.connected || now === "over" ? now : "away";
  set($("phase"), state.past ? "past" : finished ? "all done, the run is over" : now === "over" ? "the run is over" : !state.connected ? "no connection" : !told || !told.link ? "starting" : isDone() ? "all done" : now);
  set($("fleet"), state.setup?.scenario ?? state.floor?.settings.name ?? "the box");
  document.title = `${state.setup?.scenario ?? "the box"} - ${$("phase").textContent}`;
  set($("clock"), state.past ? `${state.truth.time.toFixed(2)} s` : state.truth || told ? seconds(Math.max(state.truth?.time ?? 0, told?.time ?? 0)) : "");
  set($("go"), isDrafted() && now === "running" ? "go again" : "go");
  set($("pause"), now === "paused" ? "resume" : "pause");
  $("go").disabled = state.past || !state.connected || now === "over" || (now === "running" && !isDrafted());
  $("pause").disabled = state.past || !state.connected || !["running", "paused"].includes(now);
  $("restart").disabled = $("stop").disabled = state.past || !state.connected || now === "over";
  totals(told);
}

function isDone() {
  const robots = state.overview?.robots ?? [];
  return ["running", "over"].includes(phase()) && robots.length > 0 && robots.every((robot) => robot.activity === "done");
}

function totals(told) {
  if (!told) return;
  const counts = { drive: 0, wait: 0, blocked: 0, stopped: 0, lost: 0, done: 0 };
  for (const robot of told.robots) {
    const here = robot.heard === "alive";
    const word = phase() === "waiting" ? null : !here ? "lost" : { drive: "drive", give_way: "wait", blocked: "blocked", stopped: "stopped", done: "done" }[robot.activity];
    if (word) counts[word] += 1;
  }
  const shown = Object.entries(counts).filter(([word, value]) => value || ["drive", "wait", "done"].includes(word));
  if (told.contacts) shown.push(["contacts", told.contacts]);
  if (told.pool) shown.push(["in the pool", told.pool.waiting], ["on the way", told.pool.taken], ["visited", told.pool.done]);
  const text = JSON.stringify(shown);
  if ($("totals").dataset.told !== text) {
    $("totals").dataset.told = text;
    $("totals").replaceChildren(...shown.map(([word, value]) => {
      const chip = element("span", `chip ${word.replaceAll(" ", "_")}${value ? "" : " none"}`);
      chip.append(element("b", "", String(value)), ` ${word}`);
      return chip;
    }));
  }
  const share = phase() === "waiting" ? 0 : told.share;
  $("whole_share").style.width = `${100 * share}%`;
  $("whole_share").parentElement.title = `${Math.round(100 * share)} % of all ways`;
}

function rows(page) {
  const robots = state.overview?.robots ?? [], list = $("rows");
  if (list.children.length !== robots.length || robots.some(({ robot }, at) => list.children[at].dataset.robot !== robot)) {
    list.replaceChildren(...robots.map(({ robot }) => made(robot, page)));
  }
  list.classList.toggle("many", robots.length > MANY);
  robots.forEach((told, at) => fill(list.children[at], told, robots.length > MANY));
}

function made(robot, page) {
  const item = element("li"), button = element("button", "row");
  item.dataset.robot = robot;
  button.append(element("span", "who", robot), element("span", "bar"), element("span", "doing"));
  button.querySelector(".bar").append(element("span", "filled"), element("span", "marks"));
  button.onclick = () => page.choose(state.selected === robot ? null : robot);
  item.append(button);
  return item;
}

function fill(item, told, many) {
  const [who, bar, short] = item.firstChild.children, [filled, marks] = bar.children;
  const waiting = phase() === "waiting", here = told.heard === "alive";
  const word = !here ? (waiting ? "starting" : told.heard) : waiting ? "ready" : told.doing;
  who.style.setProperty("--robot", colour(told.robot));
  filled.style.setProperty("--robot", colour(told.robot));
  filled.style.width = `${100 * (waiting ? 0 : told.share)}%`;
  if (marks.children.length !== Math.max(0, told.stops - 1) && told.stops <= 30) {
    marks.replaceChildren(...Array.from({ length: Math.max(0, told.stops - 1) }, () => element("i")));
  }
  const since = told.waits >= 1 && !waiting ? ` ${Math.round(told.waits)} s` : "";
  const queue = told.queue && here && !waiting ? `, ${nth(told.turn)} of ${told.queue}` : "";
  const brief = many || queue ? SHORT[word] ?? word : word;
  set(short, many ? brief : brief + since + queue);
  item.className = waiting ? "" : !here ? "lost" : told.activity;
  item.classList.toggle("chosen", told.robot === state.selected);
  item.dataset.shape = shape(told.robot);
  const sentence = `${titled(told.robot)} ${doing(told, about(told.robot))}`;
  if (item.firstChild.title !== sentence) item.firstChild.title = sentence;
}

/** Show another robot, or none. */
export function choose(robot) {
  state.selected = robot;
  state.rules = {};
  state.why = null;
  select(robot);
}

let shown = null;

function one(page) {
  const box = $("one"), name = state.selected;
  box.hidden = !name || !row(name);
  if (box.hidden) return void (shown = null);
  if (shown !== name) {
    shown = name;
    box.replaceChildren(...frame(name, page));
  }
  const told = row(name), seen = body(name), part = (kind) => box.querySelector(`.${kind}`);
  box.style.setProperty("--robot", colour(name));
  set(part("kind"), kindOf(state.floor, name) ? ofKind(nature(name, seen)) : "");
  set(part("does"), doing(told, about(name)));
  set(part("order"), told.assignment ? `has order ${told.assignment}` : "has the scenario's targets");
  const whom = seen?.waits.length && told.activity !== "give_way" ? [`waits for ${seen.waits.join(", ")}`] : [];
  const joint = seen?.members.length ? [`in a joint plan${leader(name)} with ${seen.members.filter((other) => other !== name).join(", ")}`] : [];
  set(part("waits"), [...whom, ...joint].join("; "));
  set(part("halt"), told.activity === "stopped" ? "go on" : "stop it");
  for (const kind of ["send", "halt", "home"]) part(kind).disabled = Boolean(state.past);
  part("ask").hidden = !state.hello?.tape;
  causes(part("causes"));
  if (seen) measures(part("measures"), seen);
  rules(part("rules"), state.rules[name]);
}

/** What a robot is, for a sentence; `seen` is its body or null. */
function nature(name, seen) {
  const kind = kindOf(state.floor, name), radius = radiusOfKind(state.floor, kind);
  return { kind, radius, loaded: seen?.radius ?? 0, top: topSpeedOfKind(state.floor, kind) };
}

function leader(name) {
  const plan = state.joint.find(({ ways }) => name in ways);
  return plan ? ` of ${plan.leader === name ? "its own" : plan.leader}` : "";
}

function frame(name, page) {
  const head = element("h2", "", name), close = element("button", "close", "\u00d7");
  close.title = "look at no robot (Esc)";
  close.onclick = () => page.choose(null);
  head.append(close);
  const act = (kind, title, what) => {
    const button = element("button", kind, title);
    button.onclick = what;
    return button;
  };
  const request = (what) => page.carry(ask(`/robot_action?robot=${encodeURIComponent(name)}`, { do: what }).then((answer) => answer.text));
  const buttons = element("div", "acts");
  buttons.append(
    act("send", "send it...", () => page.use("send")),
    act("halt", "stop it", () => request(row(name)?.activity === "stopped" ? "go_on" : "stop")),
    act("home", "home", () => request("home")),
  );
  const lines = ["does", "kind", "order", "waits"].map((kind) => element("p", kind));
  buttons.append(act("ask", "why?", () => why(page)));
  buttons.lastChild.title = "ask the run's tape why it does what it does";
  return [head, ...lines, buttons, element("ul", "causes"), element("div", "measures"), element("ul", "rules")];
}

/** What the tape says of the robot: a cause a line, those behind it further in. */
function causes(list) {
  const told = state.why, text = told ? `${told.at}\n${told.text}\n${told.doubt}` : "";
  if (list.dataset.told === text) return;
  list.dataset.told = text;
  const lines = (told?.text ?? "").split("\n").map((line) => {
    const item = element("li", told?.wrong ? "wrong" : "", line.trim());
    item.style.setProperty("--depth", (line.length - line.trimStart().length) / 2);
    return item;
  });
  const notes = [told?.at !== undefined && `at ${told.at.toFixed(2)} s:`, told?.doubt].map((note) => note && element("li", "note", note));
  list.replaceChildren(...(told ? [notes[0], ...lines, notes[1]].filter(Boolean) : []));
}

/** Where the tape of the run is, and what else reads it: each line can be copied. */
function tape(page) {
  const box = $("tape"), file = state.hello?.tape;
  box.hidden = !file;
  if (!file) return;
  const lines = [file, `swarm replay ${quoted(file)}`, `swarm why ${state.selected ?? "ROBOT"} ${quoted(file)} ${moment()}`];
  while (box.children.length <= lines.length) {
    const line = element("p"), copy = element("button", "copy", "copy");
    copy.onclick = () => page.carry(navigator.clipboard.writeText(line.firstChild.textContent).then(() => "copied"));
    line.append(element("code"), copy);
    box.append(line);
  }
  lines.forEach((text, at) => set(box.children[at + 1].firstChild, text));
  set(box.querySelector("summary code"), file.split("/").at(-1));
}

function measures(box, seen) {
  const range = state.floor ? sensorsOf(state.floor, seen.robot).range : 1.6, speed = 4;
  const told = [
    ["left", seen.left, range, "m"], ["front", seen.front, range, "m"], ["right", seen.right, range, "m"],
    ["left wheel", seen.left_v, speed, "m/s"], ["right wheel", seen.right_v, speed, "m/s"],
  ];
  if (!box.children.length) {
    box.append(...told.map(([name]) => {
      const line = element("div", "measure");
      line.append(element("span", "", name), element("meter"), element("b"));
      return line;
    }));
  }
  told.forEach(([, value, most, unit], at) => {
    const [, meter, number] = box.children[at].children;
    meter.max = most;
    meter.value = Math.abs(value);
    meter.className = unit === "m" && value < 0.8 ? "near" : "";
    set(number, `${value.toFixed(2)} ${unit}`);
  });
}

function rules(list, why) {
  if (!why || typeof why === "string") return list.replaceChildren(...(why ? [element("li", "", why)] : []));
  const fired = why.rules.map(([behaviour, number, strength, text]) => ({ strength: strength * why.weights[behaviour], text, number, behaviour }));
  fired.sort((a, b) => b.strength - a.strength);
  list.replaceChildren(...fired.slice(0, RULES).map(({ strength, text, number, behaviour }) => {
    const item = element("li"), bar = element("span", "strength");
    bar.style.width = `${100 * Math.min(1, strength)}%`;
    item.title = `${behaviour}, rule ${number}, weight ${strength.toFixed(2)}: ${text}`;
    item.append(bar, element("span", "rule", ruleInWords(text)));
    return item;
  }));
  if (!fired.length) list.append(element("li", "", "no rule fires"));
}

/** Write the events anew: the newest first. */
export function writeEvents() {
  $("events").replaceChildren(...state.events.slice(-EVENTS).reverse().map((event) => {
    const { text, trouble } = said(event), item = element("li", trouble ? "trouble" : "");
    item.append(element("time", "", event.time.toFixed(1)), element("span", "", text));
    return item;
  }));
}
