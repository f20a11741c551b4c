// The map of the wire: a grid of cells, zlib in base64. Row 0 is the lowest.

export const FREE = 0, WALL = 1, OBSTACLE = 2, UNKNOWN = 3;
const CHARACTERS = { [FREE]: ".", [WALL]: "#", [OBSTACLE]: "o" };

/** Return a `Map` of the wire with its cells unpacked. */
export async function unpacked(map) {
  const { rows, columns, resolution, origin, cells } = map.packed;
  const bytes = Uint8Array.from(atob(cells), (character) => character.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return {
    rows, columns, resolution, origin, edits: map.edits,
    cells: new Uint8Array(await new Response(stream).arrayBuffer()),
    settings: map.scenario.settings,
    starts: map.scenario.starts ?? {},
    kinds: map.scenario.kinds ?? {},
  };
}

/** Return the floor as the text of a set-up, or null if no text can say it: a map file with an origin of its own. */
export function drawing(floor) {
  if (floor.origin.some((part) => part !== 0) || floor.rows * (floor.columns + 1) > 200000) return null;
  const lines = [];
  for (let row = floor.rows - 1; row >= 0; row--) {
    let line = "";
    for (let column = 0; column < floor.columns; column++) {
      const character = CHARACTERS[floor.cells[row * floor.columns + column]];
      if (character === undefined) return null;
      line += character;
    }
    lines.push(line);
  }
  return lines.join("\n") + "\n";
}

/** Return the point [m, the grid's own frame] of a point of the map. */
export function toGrid(floor, [x, y]) {
  const [x0, y0, yaw] = floor.origin, dx = x - x0, dy = y - y0;
  return [Math.cos(yaw) * dx + Math.sin(yaw) * dy, Math.cos(yaw) * dy - Math.sin(yaw) * dx];
}

/** Return the point [m, map] of a point of the grid's own frame. */
export function fromGrid(floor, [u, v]) {
  const [x0, y0, yaw] = floor.origin;
  return [x0 + Math.cos(yaw) * u - Math.sin(yaw) * v, y0 + Math.sin(yaw) * u + Math.cos(yaw) * v];
}

/** Return the cell of a point as [row, column]; it may lie outside. */
export function cellOf(floor, point) {
  const [u, v] = toGrid(floor, point);
  return [Math.floor(v / floor.resolution), Math.floor(u / floor.resolution)];
}

export function isFree(floor, point) {
  const [row, column] = cellOf(floor, point);
  if (row < 0 || column < 0 || row >= floor.rows || column >= floor.columns) return false;
  return floor.cells[row * floor.columns + column] === FREE;
}

/**
 * Return the block of whole cells between two points: corners in the grid's frame [m], and its size in cells.
 * A drag that is nearly straight, less than a cell aside, is a wall of one cell.
 */
export function block(floor, a, b) {
  const side = floor.resolution, [r0, c0] = cellOf(floor, a);
  let [r1, c1] = cellOf(floor, b);
  const [du, dv] = [0, 1].map((axis) => Math.abs(toGrid(floor, b)[axis] - toGrid(floor, a)[axis]));
  if (Math.min(du, dv) < side && Math.max(du, dv) > 4 * Math.min(du, dv)) {
    if (du < dv) c1 = c0;
    else r1 = r0;
  }
  const low = [Math.min(c0, c1) * side, Math.min(r0, r1) * side];
  const high = [(Math.max(c0, c1) + 1) * side, (Math.max(r0, r1) + 1) * side];
  return { low, high, columns: Math.abs(c0 - c1) + 1, rows: Math.abs(r0 - r1) + 1 };
}

/** Return a function from a number of a traffic cell to its lower left corner in the grid's frame [m], and the side. */
export function lattice(floor) {
  const { cell: side, offset } = floor.settings.traffic;
  if (!side || !offset) return null;
  const columns = Math.max(0, Math.ceil((floor.columns * floor.resolution - offset[0]) / side - 0.5 - 1e-9));
  return {
    side,
    corner: (cell) => [offset[0] + (cell % columns) * side, offset[1] + Math.floor(cell / columns) * side],
  };
}

/** Return a small canvas with one pixel a cell, in the colours given by kind of cell. */
export function picture(floor, colours) {
  const canvas = document.createElement("canvas");
  canvas.width = floor.columns;
  canvas.height = floor.rows;
  const context = canvas.getContext("2d"), image = context.createImageData(floor.columns, floor.rows);
  const rgba = colours.flatMap((colour) => [...[1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16)), 255]);
  const whole = new Uint32Array(Uint8Array.from(rgba).buffer), pixels = new Uint32Array(image.data.buffer);
  for (let cell = 0; cell < floor.cells.length; cell++) pixels[cell] = whole[floor.cells[cell]];
  context.putImageData(image, 0, 0);
  return canvas;
}

/** Return a small canvas with one pixel a cell: the given cells in a colour, the others clear. */
export function sparse({ rows, columns, cells }, colour) {
  const canvas = document.createElement("canvas");
  canvas.width = columns;
  canvas.height = rows;
  const context = canvas.getContext("2d");
  context.fillStyle = colour;
  for (const cell of cells) context.fillRect(cell % columns, Math.floor(cell / columns), 1, 1);
  return canvas;
}
