// All that the page knows: what came over the wire, what is drawn and not yet asked for, and what the user looks at.

import { kindOf, mixOf, shapeOf, targetsOfKind } from "./kinds.js";

export const state = {
  hello: null, // the fleet's name, the scenarios, the robots' colours, the file of the tape
  setup: null, // what the fleet drives, as `fleet/setup`
  floor: null, // the map, unpacked; see floor.js
  clock: null,
  truth: null,
  overview: null,
  plans: new Map(), // robot -> points of its way
  trails: new Map(), // robot -> where it has been
  events: [],
  rules: {},
  joint: [], // the joint plans of the robots that are selected, here or in other browsers
  learned: null, // the floor as the robots have learned it; null: they were given it
  now: { run: -1, tick: 0, phase: null }, // of the run as it goes on, also while the past is shown
  past: null, // the moment that is shown in place of now: { run, tick, doubt }
  why: null, // what the tape says of the selected robot: { robot, at, text, doubt, wrong }
  connected: false,
  selected: null,
  tool: "look",
  layers: { names: true, ways: true, trails: true, waits: true, targets: true, starts: true, plans: true, learned: true, contacts: true, held: false, sensors: true, grid: false },
  nextStart: 0, // the robot whose start the next click puts
  draft: {}, // parts of a set-up that are drawn and not yet asked for
  preview: null, // what the pointer draws right now
};

const TRAIL = 160; // positions, at 10 Hz

/** What is drawn and not yet asked for; there is no such thing in the past. */
export function draft() {
  return state.past ? {} : state.draft;
}

/** What will be driven: the set-up with the draft over it. */
export function wanted(part) {
  return draft()[part] ?? state.setup?.[part] ?? null;
}

/** How many robots of each kind will be driven; null: the fleet has no kinds. */
export function wantedMix() {
  const there = mixOf(state.floor);
  return there && (wanted("mix") ?? there);
}

export function isDrafted() {
  return Object.keys(draft()).length > 0;
}

export function phase() {
  return state.clock?.phase ?? "waiting";
}

/** The number of a robot in the fleet, which gives its colour. */
export function number(robot) {
  return state.clock ? state.clock.robots.indexOf(robot) : -1;
}

export function colour(robot) {
  const colours = state.hello?.colours ?? ["#888"];
  return colours[Math.max(0, number(robot)) % colours.length];
}

/** A robot's name, with its kind if the fleet has kinds. */
export function titled(robot) {
  const kind = kindOf(state.floor, robot);
  return kind ? `${robot} (${kind})` : robot;
}

/** The shape by which a robot's kind is told apart. */
export function shape(robot) {
  return shapeOf(state.floor, kindOf(state.floor, robot));
}

export function row(robot) {
  return state.overview?.robots.find((one) => one.robot === robot) ?? null;
}

export function body(robot) {
  return state.truth?.bodies.find((one) => one.robot === robot) ?? null;
}

/** The targets [m] of a robot as the scenario has them: its own, those of its kind, or those that all visit. */
export function targets(robot) {
  const own = state.floor?.settings.own_targets ?? [];
  return draft().targets ?? own[number(robot)] ?? targetsOfKind(state.floor, robot) ?? wanted("targets") ?? [];
}

/** Take in the true poses: the trails grow, and start again with a new run. */
export function takeTruth(truth) {
  if (!state.truth || truth.run !== state.truth.run || truth.time < state.truth.time) state.trails = new Map();
  state.truth = truth;
  for (const { robot, x, y } of truth.bodies) {
    const trail = state.trails.get(robot) ?? [];
    const last = trail.at(-1);
    if (!last || Math.hypot(last[0] - x, last[1] - y) > 0.03) trail.push([x, y]);
    if (trail.length > TRAIL) trail.shift();
    state.trails.set(robot, trail);
  }
}

/** The ticks in a second of the run. */
export function rate() {
  return state.floor?.settings.rate ?? 20;
}

/** What a sentence on a robot needs beside its row. */
export function about(robot) {
  return { seen: body(robot), waiting: phase() === "waiting", home: state.floor?.settings.return_home ?? false };
}
