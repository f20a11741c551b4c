// Robots and what moves, on the canvas: their names, what they sense, whom they wait for.

import { radiusNow, sensorsOf } from "./kinds.js";
import { body, colour, row, shape, state } from "./state.js";
import { label, outline } from "./strokes.js";
import { theme } from "./theme.js";
import { nth } from "./words.js";

const LEAST = 5; // px, radius of a robot, however far away
const TROUBLE = ["give_way", "blocked", "stopped"];

export function sensors(context, view, few) {
  for (const one of state.truth?.bodies ?? []) {
    if (!(one.robot === state.selected || (few && !state.selected && one.activity === "drive"))) continue;
    const told = sensorsOf(state.floor, one.robot), radius = radiusNow(state.floor, one);
    for (const [name, centre, half] of sectors(told)) {
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

/** The name of each sector, the angle of its middle from ahead, and half its width [rad]. */
function sectors(told) {
  const turn = (degrees) => (degrees * Math.PI) / 180;
  return [
    ["left", turn(told.side_deg), turn(told.side_half_width_deg)],
    ["front", 0, turn(told.front_half_width_deg)],
    ["right", -turn(told.side_deg), turn(told.side_half_width_deg)],
  ];
}

export function waits(context, view) {
  context.strokeStyle = context.fillStyle = theme.wait;
  context.lineWidth = 1.8;
  for (const one of state.truth?.bodies ?? []) {
    for (const other of one.waits.map(body).filter(Boolean)) {
      const [ax, ay] = view.toScreen([one.x, one.y]), [bx, by] = view.toScreen([other.x, other.y]);
      const angle = Math.atan2(by - ay, bx - ax), back = radiusOf(view, other) + 3;
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

export function movers(context, view) {
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

/** The radius of a robot on the screen [px], by its body: its own, but never too small to be seen. */
export function radiusOf(view, one) {
  return Math.max(LEAST, radiusNow(state.floor, one) * view.scale);
}

export function robots(context, view) {
  const bodies = state.truth?.bodies ?? [];
  for (const one of bodies) {
    const radius = radiusOf(view, one), at = view.toScreen([one.x, one.y]);
    if (one.believed) shadow(context, at, radius);
    const [x, y, yaw, off] = one.believed ?? [one.x, one.y, one.yaw, 0];
    if (off) error(context, view.toScreen([x, y]), radius + off * view.scale, one);
    robot(context, one.believed ? view.toScreen([x, y]) : at, radius, { ...one, yaw });
  }
  if (state.layers.names) names(context, view, bodies);
}

/** Write the names beside the robots: right, left, above or below, where no other name or robot is; trouble first. */
function names(context, view, bodies) {
  const urgent = (one) => (one.robot === state.selected ? 2 : 0) + (TROUBLE.includes(one.activity) ? 1 : 0);
  const discs = bodies.map((one) => [...view.toScreen([one.x, one.y]), radiusOf(view, one)]), taken = [];
  const order = [...bodies.keys()].sort((a, b) => urgent(bodies[b]) - urgent(bodies[a]) || a - b);
  const meets = (box, other) => box[0] < other[2] && other[0] < box[2] && box[1] < other[3] && other[1] < box[3];
  for (const at of order) {
    const chosen = bodies[at].robot === state.selected, name = named(bodies[at]), [px, py, radius] = discs[at];
    context.font = `${chosen ? 700 : 500} 12px system-ui, sans-serif`;
    const wide = context.measureText(name).width, away = radius + 4;
    const spots = [[away, -radius * 0.4], [-away - wide, -radius * 0.4], [-wide / 2, -away - 6], [-wide / 2, away + 6]];
    const box = ([dx, dy]) => [px + dx, py + dy - 6, px + dx + wide, py + dy + 6];
    const free = (spot) => !taken.some((other) => meets(box(spot), other))
      && !discs.some(([x, y, r], other) => other !== at && meets(box(spot), [x - r, y - r, x + r, y + r]));
    const spot = spots.find(free) ?? (chosen ? spots[0] : null);
    if (!spot) continue;
    taken.push(box(spot));
    label(context, name, [px + spot[0], py + spot[1]], context.font, theme.ink, theme.halo, "left");
  }
}

/** Return a robot's name; while it waits for its turn at a target that others drive to as well, with that turn. */
function named({ robot: name, activity }) {
  const told = row(name);
  return told?.queue && activity === "give_way" ? `${name} ${nth(told.turn)}` : name;
}

/** Draw where a robot is that takes itself to be elsewhere. */
function shadow(context, [px, py], radius) {
  context.beginPath();
  context.arc(px, py, radius, 0, 7);
  context.globalAlpha = 0.25;
  context.fillStyle = theme.ink;
  context.fill();
  context.globalAlpha = 1;
}

/** Draw the ring in which a robot's body is, wherever in its error it is. */
function error(context, [px, py], radius, one) {
  context.beginPath();
  context.arc(px, py, radius, 0, 7);
  context.lineWidth = 1;
  context.setLineDash([3, 3]);
  context.strokeStyle = colour(one.robot);
  context.stroke();
  context.setLineDash([]);
}

/** Draw the round footprint of a robot whose shape does not fill it. */
function footprint(context, [px, py], radius, one) {
  context.beginPath();
  context.arc(px, py, radius, 0, 7);
  context.fillStyle = theme.floor;
  context.fill();
  context.lineWidth = 1;
  context.strokeStyle = colour(one.robot);
  context.stroke();
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
  const looks = shape(one.robot);
  if (looks !== "disc") footprint(context, [px, py], radius, one);
  outline(context, [px, py], radius, looks);
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
