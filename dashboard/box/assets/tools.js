// What the pointer does on the floor with each tool: look, start, target, wall, erase, send. Walls go to the wire at once;
// starts and targets belong to a set-up, and wait in the draft until go.

import { radiusOf } from "./bodies.js";
import { block, fromGrid, isFree } from "./floor.js";
import { kindNames, kindsIn, mixOf, radiusOfKind, startsIn } from "./kinds.js";
import { ask } from "./link.js";
import { state, wanted, wantedMix } from "./state.js";

const CLICK = 5; // px; a shorter way of the pointer is a click
const GRAB = 12; // px around a target or start that take hold of it
const NEAREST = 1.25; // m between two starts, so that each can reserve floor of its own
const ROOM = 0.45; // m of free floor around a start

/** Make the canvas hear the pointer. `page` has redraw(), carry(promise) for requests, and choose(robot). */
export function install(canvas, view, page) {
  let held = null; // what the pointer does, from its press on
  const pixel = (event) => [event.offsetX, event.offsetY];

  canvas.addEventListener("pointerdown", (event) => {
    if (!state.floor) return;
    canvas.setPointerCapture(event.pointerId);
    const at = pixel(event), tool = event.button === 1 ? "look" : state.tool;
    held = { tool, from: at, last: at, far: 0, ...(TOOLS[tool].press?.(view, at) ?? {}) };
  });
  canvas.addEventListener("pointermove", (event) => {
    const at = pixel(event);
    if (!held) return hover(canvas, view, at);
    held.far = Math.max(held.far, Math.hypot(at[0] - held.from[0], at[1] - held.from[1]));
    TOOLS[held.tool].drag?.(view, held, at);
    held.last = at;
    page.redraw();
  });
  canvas.addEventListener("pointerup", (event) => {
    if (!held) return;
    const done = held, request = TOOLS[done.tool].release?.(view, done, pixel(event), page);
    held = state.preview = null;
    if (request) page.carry(request);
    page.redraw();
  });
  canvas.addEventListener("pointercancel", () => {
    held = state.preview = null;
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    view.zoom(Math.exp(-event.deltaY * 0.0015), pixel(event));
    page.redraw();
  }, { passive: false });
}

function hover(canvas, view, at) {
  const grabs = { look: robotAt, target: targetAt, start: startAt, erase: (...where) => targetAt(...where) ?? startAt(...where) };
  const over = state.floor && (grabs[state.tool]?.(view, at) ?? null) !== null;
  canvas.style.cursor = state.tool === "look" ? (over ? "pointer" : "grab") : over ? "move" : "crosshair";
}

const TOOLS = {
  look: {
    drag(view, held, at) {
      view.pan(at[0] - held.last[0], at[1] - held.last[1]);
    },
    release(view, held, at, page) {
      if (held.far <= CLICK) page.choose(robotAt(view, at));
    },
  },

  send: {
    release(view, held, at) {
      if (held.far > CLICK || !state.selected) return null;
      const order = { id: crypto.randomUUID(), targets: [rounded(view.toMap(at))] };
      return ask(`/order?robot=${encodeURIComponent(state.selected)}`, order).then((answer) => answer.text);
    },
  },

  target: {
    press(view, at) {
      const list = (wanted("targets") ?? []).map((point) => [...point]), found = targetAt(view, at);
      const number = found ?? list.push(rounded(view.toMap(at))) - 1;
      state.draft.targets = list;
      return { number };
    },
    drag(view, held, at) {
      if (held.far > CLICK) state.draft.targets[held.number] = rounded(view.toMap(at));
    },
  },

  start: {
    press(view, at) {
      const list = starts(), mix = startMix(), found = startAt(view, at);
      const number = found ?? state.nextStart % Math.max(1, list.length);
      if (found === null) {
        list[number] = [...rounded(view.toMap(at)), list[number]?.[2] ?? 0];
        state.nextStart = number + 1;
      }
      putStarts(list, mix);
      return { number, moves: found !== null };
    },
    drag(view, held, at) {
      if (held.far <= CLICK) return;
      const start = state.draft.starts[held.number], [x, y] = view.toMap(at);
      state.draft.starts[held.number] = held.moves
        ? [...rounded([x, y]), start[2]]
        : [start[0], start[1], Math.atan2(y - start[1], x - start[0])];
    },
  },

  wall: area("wall"),
  erase: area("erase"),
};

/** A tool that drags a block of whole cells from corner to corner. */
function area(kind) {
  const blocked = (view, held, at) => block(state.floor, view.toMap(held.from), view.toMap(at));
  return {
    press(view, at) {
      preview(kind, block(state.floor, view.toMap(at), view.toMap(at)), at);
      return kind === "erase" ? { target: targetAt(view, at), start: startAt(view, at) } : {};
    },
    drag(view, held, at) {
      preview(kind, blocked(view, held, at), at);
    },
    release(view, held, at) {
      if (kind === "erase" && held.far <= CLICK && (held.target !== null || held.start !== null)) return take(held);
      const { low, high } = blocked(view, held, at);
      return edit(kind === "erase" ? "free" : "wall", low, high);
    },
  };
}

function preview(kind, { low, high, columns, rows }, at) {
  const side = state.floor.resolution;
  state.preview = { kind, low, high, at, text: `${(columns * side).toFixed(1)} x ${(rows * side).toFixed(1)} m` };
}

/** Ask for walls, or for free floor, in a block of the grid's frame [m]; the corners stay clear of the cells beside. */
async function edit(kind, low, high) {
  const inside = state.floor.resolution * 0.01;
  const corner = ([u, v], by) => fromGrid(state.floor, [u + by, v + by]);
  const { text, cuts } = await ask("/edit", { kind, low: corner(low, inside), high: corner(high, -inside) });
  return cuts?.length ? text : null;
}

/** Take away a target or a start of the draft. */
function take({ target, start }) {
  if (target !== null) {
    state.draft.targets = wanted("targets").filter((_, at) => at !== target);
  } else {
    const left = starts().filter((_, at) => at !== start), mix = startMix();
    if (!left.length) return Promise.reject(new Error("a run needs a robot; move its start with the tool start"));
    putStarts(left, mix && fewer(mix, kindsIn(mix)[start]));
  }
  return null;
}

/** Return a copy of the starts as they will be driven, in the order of the robots. */
export function starts() {
  return (state.draft.starts ?? startsIn(state.floor)).map((start) => [...start]);
}

/** How many of these starts are of each kind, in their order; null: the fleet has no kinds. */
function startMix() {
  return state.draft.starts ? wantedMix() : mixOf(state.floor);
}

function fewer(mix, kind) {
  const { [kind]: before, ...others } = mix;
  return before > 1 ? { ...mix, [kind]: before - 1 } : others;
}

/** Ask for starts, of a fleet with kinds with how many of them are of each kind. */
function putStarts(list, mix) {
  state.draft.starts = list;
  delete state.draft.robots;
  if (mix) state.draft.mix = mix;
}

/** Ask for a mix: the launcher finds the starts if no kind has a list of them, else they are put here. */
export function setMix(mix) {
  const { start, kinds } = state.floor.settings, listed = start.poses || Object.values(kinds).some((kind) => kind.start?.poses);
  if (!state.draft.starts && !listed) {
    state.draft.mix = mix;
    return;
  }
  const of = kindsIn(startMix()), before = starts(), groups = {};
  for (const kind of Object.keys(mix)) groups[kind] = before.filter((_, at) => of[at] === kind).slice(0, mix[kind]);
  for (const [kind, group] of Object.entries(groups)) {
    while (group.length < mix[kind]) group.push(spotFor(mix[kind], Object.values(groups).flat(), group.at(-1) ?? before.at(-1), kind));
  }
  putStarts(Object.values(groups).flat(), mix);
}

/** Ask for a number of robots: the launcher finds the starts if the scenario has an area, else they are put here. */
export function setRobots(count) {
  if (!state.draft.starts && !state.floor.settings.start.poses) {
    state.draft.robots = count;
    return;
  }
  const list = starts().slice(0, count);
  while (list.length < count) list.push(spotFor(count, list, list.at(-1), ""));
  putStarts(list, null);
}

/** Return a start for one more robot beside another one; throw an Error with a sentence if there is no room. */
function spotFor(count, list, beside, kind) {
  const spot = spotBeside(list, beside, kind);
  if (!spot) throw new Error(`expected room for ${count} robots${kind && ` of the kind ${kind}`} beside each other, found none for one of them; put starts by hand`);
  return spot;
}

function spotBeside(list, [x, y, yaw], kind) {
  const widest = Math.max(...["", ...kindNames(state.floor)].map((one) => radiusOfKind(state.floor, one)));
  const apart = Math.max(NEAREST, 4 * widest), room = Math.max(ROOM, radiusOfKind(state.floor, kind) + 0.1), around = [-room, 0, room];
  const roomy = ([px, py]) => around.every((dx) => around.every((dy) => isFree(state.floor, [px + dx, py + dy])));
  for (let ring = 1; ring < 40; ring++) {
    for (let side = -ring; side <= ring; side++) {
      for (const [i, j] of [[side, ring], [ring, side], [side, -ring], [-ring, side]]) {
        const spot = rounded([x + i * apart, y + j * apart]);
        const free = list.every(([ox, oy]) => Math.max(Math.abs(ox - spot[0]), Math.abs(oy - spot[1])) >= apart - 0.01);
        if (free && roomy(spot)) return [...spot, yaw];
      }
    }
  }
  return null;
}

const rounded = ([x, y]) => [Math.round(x * 100) / 100, Math.round(y * 100) / 100];

/** Return the number of the point that a pixel is nearest to, as seen from the edge of its reach [px]; null: of none. */
function nearest(view, at, points, reachOf) {
  let best = 0, found = null;
  points.forEach((point, number) => {
    const [px, py] = view.toScreen(point), outside = Math.hypot(px - at[0], py - at[1]) - reachOf(number);
    if (outside <= best) [best, found] = [outside, number];
  });
  return found;
}

const targetAt = (view, at) => nearest(view, at, wanted("targets") ?? [], () => GRAB);
const startAt = (view, at) => nearest(view, at, starts(), () => GRAB);

/** Return the name of the robot at a pixel, or null. */
export function robotAt(view, at) {
  const bodies = state.truth?.bodies ?? [];
  const found = nearest(view, at, bodies.map(({ x, y }) => [x, y]), (number) => radiusOf(view, bodies[number]) + 6);
  return found === null ? null : bodies[found].robot;
}
