// The arena on the canvas, layer over layer. It reads the state and changes nothing.

import { fromGrid, lattice, picture } from "./floor.js";
import { body, colour, number, row, state, targets, wanted } from "./state.js";

const LEAST = 5; // px, radius of a robot, however far away
const DETAILED = 8; // robots; of more, only the selected one shows its sensors and cells

let theme = {}, drawn = { floor: null, theme: null, canvas: null };

/** Read the colours of the theme, which the style sheet has. */
export function readTheme() {
  const style = getComputedStyle(document.documentElement);
  const names = ["ink", "soft", "floor", "wall", "obstacle", "unknown", "grid", "target", "start", "wait", "bad", "good", "halo"];
  theme = Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

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
  if (layers.targets) stops(context, view);
  if (layers.ways) ways(context, view);
  if (layers.sensors) sensors(context, view, few);
  if (layers.waits) waits(context, view);
  movers(context, view);
  robots(context, view);
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
  context.drawImage(drawn.canvas, 0, 0, columns * side, rows * side);
  context.restore();
}

function path(context, view, points) {
  context.beginPath();
  points.forEach((point, at) => context[at ? "lineTo" : "moveTo"](...view.toScreen(point)));
}

function quad(context, view, low, high) {
  const ring = [low, [high[0], low[1]], high, [low[0], high[1]]];
  path(context, view, ring.map((corner) => fromGrid(state.floor, corner)));
  context.closePath();
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

function ways(context, view) {
  context.lineWidth = 1.6;
  context.lineJoin = context.lineCap = "round";
  for (const [robot, points] of state.plans) {
    const one = body(robot);
    if (!one || points.length < 2 || ["done", "ready"].includes(one.activity)) continue;
    context.strokeStyle = context.fillStyle = colour(robot);
    context.globalAlpha = state.selected && state.selected !== robot ? 0.25 : 0.85;
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

function square(context, [px, py], half, corner = 3) {
  context.beginPath();
  context.roundRect(px - half, py - half, 2 * half, 2 * half, corner);
}

function starts(context, view) {
  const drafted = state.draft.starts, told = drafted ?? Object.values(state.floor.starts);
  const half = Math.max(4, state.floor.settings.robot.radius * view.scale * 1.15);
  context.lineWidth = 1.5;
  context.strokeStyle = context.fillStyle = theme.start;
  for (const [x, y, yaw] of told) {
    const [px, py] = view.toScreen([x, y]);
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

function stops(context, view) {
  const own = state.floor.settings.own_targets.length && !state.draft.targets;
  const robots = own ? (state.selected ? [state.selected] : state.clock?.robots ?? []) : [null];
  const size = Math.min(11, Math.max(7, 0.34 * view.scale));
  for (const robot of robots) {
    const to = robot ? row(robot)?.target : null;
    targets(robot).forEach((point, at) => {
      const pixel = view.toScreen(point);
      context.fillStyle = robot ? colour(robot) : theme.target;
      context.globalAlpha = 0.12;
      context.beginPath();
      context.arc(...pixel, state.floor.settings.reach * view.scale, 0, 7);
      context.fill();
      context.globalAlpha = to !== null && to !== at ? 0.5 : 1;
      if (robots.length > DETAILED) {
        square(context, pixel, 3, 1);
        context.fill();
      } else {
        square(context, pixel, size);
        context.fill();
        label(context, String(at + 1), pixel, `600 ${Math.round(size * 1.25)}px system-ui, sans-serif`, theme.floor);
      }
    });
  }
  context.globalAlpha = 1;
}

function label(context, text, [px, py], font, fill, halo = null, align = "center") {
  context.font = font;
  context.textAlign = align;
  context.textBaseline = "middle";
  if (halo) {
    context.strokeStyle = halo;
    context.lineWidth = 3.5;
    context.lineJoin = "round";
    context.strokeText(text, px, py);
  }
  context.fillStyle = fill;
  context.fillText(text, px, py + 0.5);
}

function sensors(context, view, few) {
  const told = state.floor.settings.sensors, radius = state.floor.settings.robot.radius;
  const turn = (degrees) => (degrees * Math.PI) / 180;
  const sectors = [
    ["left", turn(told.side_deg), turn(told.side_half_width_deg)],
    ["front", 0, turn(told.front_half_width_deg)],
    ["right", -turn(told.side_deg), turn(told.side_half_width_deg)],
  ];
  for (const one of state.truth?.bodies ?? []) {
    if (!(one.robot === state.selected || (few && !state.selected && one.activity === "drive"))) continue;
    for (const [name, centre, half] of sectors) {
      const reach = one[name], near = reach < 0.8, seen = reach < told.range - 1e-6;
      context.globalAlpha = near ? 0.26 : seen ? 0.18 : 0.07;
      context.fillStyle = near ? theme.bad : theme.ink;
      context.beginPath();
      const [px, py] = view.toScreen([one.x, one.y]), far = (radius + reach) * view.scale;
      context.moveTo(px, py);
      context.arc(px, py, far, -(one.yaw + centre + half), -(one.yaw + centre - half));
      context.closePath();
      context.fill();
    }
  }
  context.globalAlpha = 1;
}

function waits(context, view) {
  context.strokeStyle = context.fillStyle = theme.wait;
  context.lineWidth = 1.8;
  for (const one of state.truth?.bodies ?? []) {
    for (const other of one.waits.map(body).filter(Boolean)) {
      const [ax, ay] = view.toScreen([one.x, one.y]), [bx, by] = view.toScreen([other.x, other.y]);
      const angle = Math.atan2(by - ay, bx - ax), back = radiusOf(view) + 3;
      const [tx, ty] = [bx - Math.cos(angle) * back, by - Math.sin(angle) * back];
      context.globalAlpha = 0.9;
      context.beginPath();
      context.moveTo(ax, ay);
      context.lineTo(tx, ty);
      context.stroke();
      context.beginPath();
      context.moveTo(tx, ty);
      for (const aside of [0.4, -0.4]) context.lineTo(tx - 9 * Math.cos(angle + aside), ty - 9 * Math.sin(angle + aside));
      context.fill();
    }
  }
  context.globalAlpha = 1;
}

function movers(context, view) {
  context.fillStyle = theme.obstacle;
  for (const { x, y, yaw, radius, size } of state.truth?.movers ?? []) {
    context.save();
    context.translate(...view.toScreen([x, y]));
    context.rotate(-yaw);
    context.beginPath();
    if (radius) context.arc(0, 0, radius * view.scale, 0, 7);
    else context.rect((-size[0] / 2) * view.scale, (-size[1] / 2) * view.scale, size[0] * view.scale, size[1] * view.scale);
    context.fill();
    context.restore();
  }
}

/** The radius of a robot on the screen [px]: its own, but never too small to be seen. */
export function radiusOf(view) {
  return Math.max(LEAST, (state.floor?.settings.robot.radius ?? 0.2) * view.scale);
}

function robots(context, view) {
  const bodies = state.truth?.bodies ?? [], radius = radiusOf(view), taken = [];
  for (const one of bodies) robot(context, view.toScreen([one.x, one.y]), radius, one);
  if (!state.layers.names) return;
  const order = [...bodies].sort((a, b) => (b.robot === state.selected) - (a.robot === state.selected) || number(a.robot) - number(b.robot));
  for (const one of order) {
    const [px, py] = view.toScreen([one.x, one.y]), at = [px + radius + 4, py - radius * 0.4];
    const box = [at[0], at[1] - 7, at[0] + 8 * one.robot.length, at[1] + 7];
    if (taken.some((other) => box[0] < other[2] && other[0] < box[2] && box[1] < other[3] && other[1] < box[3])) continue;
    taken.push(box);
    label(context, one.robot, at, `${one.robot === state.selected ? 700 : 500} 12px system-ui, sans-serif`, theme.ink, theme.halo, "left");
  }
}

function robot(context, [px, py], radius, one) {
  const heard = row(one.robot)?.heard ?? "alive", here = heard === "alive";
  const ring = { give_way: theme.wait, blocked: theme.bad, stopped: theme.bad }[one.activity];
  if (one.robot === state.selected || ring) {
    context.beginPath();
    context.arc(px, py, radius + 3.5, 0, 7);
    context.lineWidth = 2;
    context.strokeStyle = ring ?? theme.ink;
    context.stroke();
  }
  context.globalAlpha = here ? 1 : 0.4;
  context.beginPath();
  context.arc(px, py, radius, 0, 7);
  context.fillStyle = colour(one.robot);
  context.fill();
  context.lineWidth = 1.2;
  context.strokeStyle = theme.ink;
  context.stroke();
  context.beginPath();
  context.moveTo(px, py);
  context.lineTo(px + Math.cos(one.yaw) * radius * 1.35, py - Math.sin(one.yaw) * radius * 1.35);
  context.lineWidth = Math.max(2, radius * 0.28);
  context.lineCap = "round";
  context.stroke();
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
