// Robots unlike each other: of which kind each is, and what that kind has of its own. `floor` is the map, unpacked. The
// kind of all robots of a fleet without kinds is "".

const SHAPES = ["disc", "hexagon", "diamond", "square", "triangle"]; // of the first kind, the second, ...; then again
const CORNERS = { hexagon: [6, 0], diamond: [4, 0], square: [4, Math.PI / 4], triangle: [3, Math.PI / 2] }; // number, angle

/** The names of all kinds, in the order of the scenario. */
export function kindNames(floor) {
  return Object.keys(floor?.settings.kinds ?? {});
}

export function kindOf(floor, robot) {
  return floor?.kinds[robot] ?? "";
}

/** The shape by which robots of a kind are told apart. */
export function shapeOf(floor, kind) {
  return SHAPES[Math.max(0, kindNames(floor).indexOf(kind)) % SHAPES.length];
}

/** The corners of a shape around (0, 0), in a circle of radius 1; none for a disc. */
export function cornersOf(shape) {
  const [corners, first] = CORNERS[shape] ?? [0, 0];
  return Array.from({ length: corners }, (_, at) => first + (at * 2 * Math.PI) / corners).map((angle) => [Math.cos(angle), -Math.sin(angle)]);
}

/** The radius [m] of robots of a kind that carry nothing. */
export function radiusOfKind(floor, kind) {
  return floor?.settings.kinds?.[kind]?.radius ?? floor?.settings.robot.radius ?? 0.2;
}

/** The radius [m] of a robot as it is now, by its body: with its load, if it carries one. */
export function radiusNow(floor, body) {
  return body.radius || radiusOfKind(floor, kindOf(floor, body.robot));
}

export function sensorsOf(floor, robot) {
  return floor.settings.kinds?.[kindOf(floor, robot)]?.sensors ?? floor.settings.sensors;
}

/** The fastest that robots of a kind drive [m/s]: their share of the paper's 4 m/s. */
export function topSpeedOfKind(floor, kind) {
  return 4 * (floor.settings.kinds?.[kind]?.speed_scale ?? floor.settings.robot.speed_scale);
}

/** The targets [m] that a robot's kind has of its own, or null. */
export function targetsOfKind(floor, robot) {
  return floor?.settings.kinds?.[kindOf(floor, robot)]?.targets ?? null;
}

/** How many robots of each kind there are, as a set-up says it; null: the fleet has no kinds. */
export function mixOf(floor) {
  if (!kindNames(floor).length) return null;
  const mix = {};
  for (const kind of Object.values(floor.kinds)) mix[kind] = (mix[kind] ?? 0) + 1;
  return mix;
}

/** The kind of each robot of a mix, in the order of their numbers. */
export function kindsIn(mix) {
  return Object.entries(mix).flatMap(([kind, count]) => Array.from({ length: count }, () => kind));
}

/** The starts of all robots in the order that their mix has: a robot that was added later stands among its kind. */
export function startsIn(floor) {
  const order = Object.keys(mixOf(floor) ?? {}), place = ([robot]) => order.indexOf(kindOf(floor, robot));
  return Object.entries(floor?.starts ?? {}).sort((one, other) => place(one) - place(other)).map(([, start]) => start);
}

/** Return a mix with another number of robots of a kind; throw an Error with a sentence if that is no mix. */
export function changed(mix, kind, count, most = 1000) {
  const { [kind]: before = 0, ...others } = mix, total = Object.values(others).reduce((sum, one) => sum + one, 0) + count;
  if (!(Number.isInteger(count) && count >= 0)) throw new Error(`${kind}: expected a number of robots, 0 or more, got ${count}`);
  if (total < 1) throw new Error("a run needs a robot; ask for more of another kind first");
  if (total > most) throw new Error(`${kind}: expected at most ${most} robots of all kinds together, got ${total}; ask for fewer than ${before + 1}`);
  return count ? { ...mix, [kind]: count } : others;
}
