// The arena on the canvas, layer over layer. It reads the state and changes nothing.

import { movers, robots, sensors, waits } from "./bodies.js";
import { fromGrid, lattice, picture, sparse } from "./floor.js";
import { kindNames, kindOf, kindsIn, radiusOfKind, targetsOfKind } from "./kinds.js";
import { body, colour, draft, row, shape, state, targets } from "./state.js";
import { label, outline, path, quad, square } from "./strokes.js";
import { theme } from "./theme.js";

const DETAILED = 8; // robots; of more, only the selected one shows its sensors and cells

const TRUE_SHADE = 0.22; // of the true walls, where robots learn them

let drawn = { floor: null, theme: null, canvas: null }, learnt = { learned: null, theme: null, canvas: null };

export function draw(context, view) {
  const { width, height } = view, ratio = devicePixelRatio;
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  if (!state.floor) return;
  floor(context, view);
  const { layers } = state, few = (state.truth?.bodies.length ?? 0) <= DETAILED;
  if (layers.grid) grid(context, view);
  if (layers.held) held(context, view, few);
  if (layers.trails) trails(context, view);
  if (layers.starts) starts(context, view);
  if (layers.plans) plans(context, view);
  if (layers.ways) ways(context, view, few);
  if (layers.targets) stops(context, view);
  if (layers.sensors) sensors(context, view, few);
  if (layers.waits) waits(context, view);
  movers(context, view);
  robots(context, view);
  if (layers.contacts) contacts(context, view);
  if (layers.plans) turns(context, view);
  preview(context, view);
}

function floor(context, view) {
  if (drawn.floor !== state.floor || drawn.theme !== theme) {
    const colours = [theme.floor, theme.wall, theme.obstacle, theme.unknown];
    drawn = { floor: state.floor, theme, canvas: picture(state.floor, colours) };
  }
  const { rows, columns, resolution, origin } = state.floor;
  const [px, py] = view.toScreen([origin[0], origin[1]]), side = resolution * view.scale;
  context.save();
  context.translate(px, py);
  context.rotate(-origin[2]);
  context.scale(1, -1); // row 0 is the lowest
  context.imageSmoothingEnabled = side < 1;
  const learns = state.learned && state.layers.learned;
  if (learns) {
    context.fillStyle = theme.floor;
    context.fillRect(0, 0, columns * side, rows * side);
    context.globalAlpha = TRUE_SHADE;
  }
  context.drawImage(drawn.canvas, 0, 0, columns * side, rows * side);
  context.globalAlpha = 1;
  if (learns) context.drawImage(learntPicture(), 0, 0, columns * side, rows * side);
  context.restore();
}

function learntPicture() {
  if (learnt.learned !== state.learned || learnt.theme !== theme) {
    learnt = { learned: state.learned, theme, canvas: sparse(state.learned, theme.wall) };
  }
  return learnt.canvas;
}

function grid(context, view) {
  const { rows, columns, resolution } = state.floor, wide = columns * resolution, high = rows * resolution;
  context.strokeStyle = theme.grid;
  context.lineWidth = 1;
  for (let at = 1; at < Math.max(wide, high); at++) {
    for (const [from, to, most] of [[[at, 0], [at, high], wide], [[0, at], [wide, at], high]]) {
      if (at >= most) continue;
      path(context, view, [fromGrid(state.floor, from), fromGrid(state.floor, to)]);
      context.stroke();
    }
  }
}

function held(context, view, few) {
  const cells = lattice(state.floor);
  if (!cells) return;
  for (const one of state.truth?.bodies ?? []) {
    if (!few && one.robot !== state.selected) continue;
    context.fillStyle = colour(one.robot);
    context.globalAlpha = 0.16;
    for (const cell of one.held) {
      const [u, v] = cells.corner(cell), gap = cells.side * 0.03;
      quad(context, view, [u + gap, v + gap], [u + cells.side - gap, v + cells.side - gap]);
      context.fill();
    }
  }
  context.globalAlpha = 1;
}

function trails(context, view) {
  context.lineJoin = context.lineCap = "round";
  context.lineWidth = Math.max(2, 0.1 * view.scale);
  context.globalAlpha = 0.28;
  for (const [robot, points] of state.trails) {
    if (points.length < 2) continue;
    context.strokeStyle = colour(robot);
    path(context, view, points);
    context.stroke();
  }
  context.globalAlpha = 1;
}

/** Return what is left of a way: from the robot over the points beyond the leg that it is on. */
function rest(points, [x, y]) {
  let best = Infinity, next = 1;
  for (let at = 1; at < points.length; at++) {
    const [ax, ay] = points[at - 1], [bx, by] = points[at], dx = bx - ax, dy = by - ay;
    const along = Math.min(1, Math.max(0, ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1)));
    const away = Math.hypot(x - ax - along * dx, y - ay - along * dy);
    if (away < best - 1e-6) [best, next] = [away, at];
  }
  return [[x, y], ...points.slice(next)];
}

function ways(context, view, few) {
  context.lineJoin = context.lineCap = "round";
  for (const [robot, points] of state.plans) {
    const one = body(robot);
    if (!one || points.length < 2 || ["done", "ready"].includes(one.activity)) continue;
    context.strokeStyle = context.fillStyle = colour(robot);
    const chosen = state.selected === robot;
    context.globalAlpha = chosen || (few && !state.selected) ? 0.85 : state.selected ? 0.2 : 0.45;
    context.lineWidth = chosen || few ? 1.6 : 1;
    context.setLineDash([5, 4]);
    const left = rest(points, [one.x, one.y]);
    path(context, view, left);
    context.stroke();
    context.setLineDash([]);
    context.beginPath();
    context.arc(...view.toScreen(left.at(-1)), 3, 0, 7);
    context.fill();
  }
  context.globalAlpha = 1;
}

/** The joint plan of the selected robot: the way of each member through its cells. */
function plans(context, view) {
  context.lineWidth = Math.max(3, 0.16 * view.scale);
  context.lineJoin = context.lineCap = "round";
  context.globalAlpha = 0.4;
  for (const { ways: lines } of chosenPlans()) {
    for (const [robot, points] of Object.entries(lines)) {
      context.strokeStyle = colour(robot);
      path(context, view, points);
      context.stroke();
    }
  }
  context.globalAlpha = 1;
}

/** In which order the members of that plan enter a cell. */
function turns(context, view) {
  for (const { turns: told } of chosenPlans()) {
    for (const { at, robots: order } of told) {
      label(context, order, view.toScreen(at), "500 11px system-ui, sans-serif", theme.ink, theme.halo);
    }
  }
}

const chosenPlans = () => state.joint.filter(({ ways: lines }) => state.selected in lines);

/** A cross wherever a robot has touched something in this run, as far as the events go back. */
function contacts(context, view) {
  context.strokeStyle = theme.bad;
  context.lineWidth = 2.5;
  context.lineCap = "round";
  for (const { kind, run, at } of state.events) {
    if (kind !== "contact" || !at || run !== state.truth?.run) continue;
    const [px, py] = view.toScreen(at);
    for (const up of [1, -1]) {
      context.beginPath();
      context.moveTo(px - 5, py - 5 * up);
      context.lineTo(px + 5, py + 5 * up);
      context.stroke();
    }
  }
}

function starts(context, view) {
  const { starts: drafted, mix } = draft(), told = drafted ?? Object.values(state.floor.starts);
  const kinds = drafted ? kindsIn(mix ?? {}) : Object.keys(state.floor.starts).map((robot) => kindOf(state.floor, robot));
  context.lineWidth = 1.5;
  context.strokeStyle = context.fillStyle = theme.start;
  for (const [at, [x, y, yaw]] of told.entries()) {
    const half = Math.max(4, radiusOfKind(state.floor, kinds[at]) * view.scale * 1.15), [px, py] = view.toScreen([x, y]);
    square(context, [px, py], half);
    context.globalAlpha = drafted ? 0.3 : 0.1;
    context.fill();
    context.globalAlpha = drafted ? 1 : 0.55;
    context.stroke();
    if (drafted) {
      context.beginPath();
      context.moveTo(px, py);
      context.lineTo(px + Math.cos(yaw) * half * 1.6, py - Math.sin(yaw) * half * 1.6);
      context.stroke();
    }
  }
  context.globalAlpha = 1;
}

/** Whose targets are drawn: those of each robot, those of the first robot of each kind, or, as null, those of all. */
function visitors() {
  const robots = state.selected ? [state.selected] : state.clock?.robots ?? [];
  if (draft().targets) return [null];
  if (state.floor.settings.own_targets.length) return robots;
  if (!kindNames(state.floor).length || !robots.some((robot) => targetsOfKind(state.floor, robot))) return [null];
  return [...new Map([...robots].reverse().map((robot) => [kindOf(state.floor, robot), robot])).values()];
}

function stops(context, view) {
  const own = state.floor.settings.own_targets.length, robots = visitors();
  const size = Math.min(11, Math.max(7, 0.34 * view.scale));
  for (const robot of robots) {
    const to = robot && (own || state.selected) ? row(robot)?.target : null;
    targets(robot).forEach((point, at) => {
      const pixel = view.toScreen(point);
      context.fillStyle = robot && own ? colour(robot) : theme.target;
      context.globalAlpha = 0.12;
      context.beginPath();
      context.arc(...pixel, state.floor.settings.reach * view.scale, 0, 7);
      context.fill();
      context.globalAlpha = to !== null && to !== at ? 0.5 : 1;
      if (robots.length > DETAILED) {
        square(context, pixel, 3, 1);
        context.fill();
      } else {
        if (robot && !own) outline(context, pixel, size * 1.3, shape(robot));
        else square(context, pixel, size);
        context.fill();
        label(context, String(at + 1), pixel, `600 ${Math.round(size * 1.25)}px system-ui, sans-serif`, theme.floor);
      }
    });
  }
  context.globalAlpha = 1;
}

function preview(context, view) {
  const shown = state.preview;
  if (!shown) return;
  const red = shown.kind === "erase" || shown.kind === "start";
  context.fillStyle = context.strokeStyle = red ? theme.start : theme.wall;
  context.lineWidth = 1.5;
  if (shown.low) {
    quad(context, view, shown.low, shown.high);
    context.globalAlpha = 0.35;
    context.fill();
    context.globalAlpha = 1;
    context.stroke();
  }
  if (shown.text) label(context, shown.text, [shown.at[0] + 14, shown.at[1] - 14], "500 12px system-ui, sans-serif", theme.ink, theme.halo, "left");
}
