// Strokes that several layers use.

import { fromGrid } from "./floor.js";
import { cornersOf } from "./kinds.js";
import { state } from "./state.js";

export function path(context, view, points) {
  context.beginPath();
  points.forEach((point, at) => context[at ? "lineTo" : "moveTo"](...view.toScreen(point)));
}

export function quad(context, view, low, high) {
  const ring = [low, [high[0], low[1]], high, [low[0], high[1]]];
  path(context, view, ring.map((corner) => fromGrid(state.floor, corner)));
  context.closePath();
}

export function square(context, [px, py], half, corner = 3) {
  context.beginPath();
  context.roundRect(px - half, py - half, 2 * half, 2 * half, corner);
}

/** The outline of a robot or of what belongs to its kind: a disc, or a shape with its corners on the disc's edge. */
export function outline(context, [px, py], radius, shape) {
  const corners = cornersOf(shape);
  context.beginPath();
  if (!corners.length) context.arc(px, py, radius, 0, 7);
  corners.forEach(([x, y], at) => context[at ? "lineTo" : "moveTo"](px + x * radius, py + y * radius));
  if (corners.length) context.closePath();
}

export function label(context, text, [px, py], font, fill, halo = null, align = "center") {
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
