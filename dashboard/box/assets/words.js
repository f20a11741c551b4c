// Events and numbers in plain words. An event that is not listed here is shown with the text that it came with.

const NAMES = { running: "the robots drive", paused: "paused", waiting: "waiting for go", over: "the run is over" };
const TROUBLE = new Set(["contact", "lost", "gone", "stale", "stalled", "unreachable", "edit_refused", "request_refused", "traffic_fault", "false_claim", "overdue", "jam"]);

/** Return an event as {text, trouble}. */
export function said(event) {
  let text = event.text;
  if (event.kind === "phase") text = NAMES[text.split(" ").at(-1)] ?? text;
  if (event.kind === "edit") text = edited(text);
  text = text.replace(/ in \d+ ticks$/, "");
  if (event.robot && !text.startsWith(event.robot)) text = `${event.robot} ${text}`;
  return { text, trouble: TROUBLE.has(event.kind) };
}

function edited(text) {
  const found = text.match(/^(\w+) from \(([-\d.e]+), ([-\d.e]+)\) to \(([-\d.e]+), ([-\d.e]+)\)/);
  if (!found) return text;
  const [, kind, x0, y0, x1, y1] = found, size = (a, b) => Math.abs(b - a).toFixed(1);
  const what = { wall: "a wall was put up", obstacle: "an obstacle was put up", free: "the floor was cleared" }[kind] ?? kind;
  const at = `(${((+x0 + +x1) / 2).toFixed(1)}, ${((+y0 + +y1) / 2).toFixed(1)})`;
  return `${what}, ${size(x0, x1)} x ${size(y0, y1)} m at ${at}${text.slice(found[0].length)}`;
}

/**
 * Return what a robot does as a sentence without its name: `told` is its row, `seen` its body or null; `waiting`: the run
 * has not begun; `home`: the last stop of the scenario is its start.
 */
export function doing(told, { seen, waiting, home }) {
  const { activity, heard, target, stops, reached, left, unreachable } = told;
  const stop = home && !told.assignment && target === stops - 1 ? "home" : `target ${target + 1}`;
  const queue = told.queue ? `, ${nth(told.turn)} of ${told.queue} there` : "";
  const way = target < stops ? `${stop}, ${left.toFixed(1)} m left${queue}` : "its end";
  const whom = seen?.waits.length ? ` to ${seen.waits.join(", ")}` : "", since = told.waits >= 1 ? ` for ${Math.round(told.waits)} s` : "";
  const done = `${reached} of ${count(stops, "target")} reached`;
  const lost = unreachable.length ? `; no way leads to ${unreachable.map((one) => one + 1).join(", ")}` : "";
  if (heard !== "alive") return { stale: "is there, but says nothing", gone: "has left; its body stands where it was", lost: "is lost: its process is gone" }[heard] ?? heard;
  if (waiting || !stops) return "is ready, and waits for go";
  const says = {
    drive: `drives to ${way}; ${done}`,
    give_way: `gives way${whom}${since}, before ${stop}${queue}; ${done}`,
    blocked: `is blocked${since}: something unexpected is in its way to ${stop}${queue}; ${done}`,
    stopped: `stands: it was told to stop; ${done}`,
    done: `is done: ${done}`,
    ready: `is ready; ${done}`,
  };
  return (says[activity] ?? told.doing) + lost;
}

/** Return what a robot is as a sentence without its name: its kind, its radius [m] and with its load, and its speed [m/s]. */
export function ofKind({ kind, radius, loaded, top }) {
  const load = loaded > radius ? `, with its load ${loaded.toFixed(2)} m` : "";
  return `is of the kind ${kind}: ${radius.toFixed(2)} m in radius${load}; it drives at most ${top.toFixed(2)} m/s`;
}

/** Return a rule in short words: "left far, front near: left wheel slow, right wheel fast". */
export function ruleInWords(text) {
  const short = text.replace(/^IF /, "").replace(" THEN ", ": ").replaceAll(" AND ", ", ").replaceAll(" is ", " ");
  return short.replaceAll("_obs", "").replaceAll("head_ang", "heading").replaceAll("left_v", "left wheel").replaceAll("right_v", "right wheel");
}

export function seconds(value) {
  if (value < 60) return `${value.toFixed(1)} s`;
  return `${Math.floor(value / 60)} min ${Math.floor(value % 60)} s`;
}

/** Return "1st", "2nd", "3rd", "4th", ... */
export function nth(number) {
  const last = [11, 12, 13].includes(number % 100) ? 0 : number % 10;
  return `${number}${["th", "st", "nd", "rd"][last] ?? "th"}`;
}

/** Return a count with its word: "1 robot", "3 robots". */
export function count(value, word) {
  return `${value} ${word}${value === 1 ? "" : "s"}`;
}

/** Return a text as one word of a shell. */
export function quoted(text) {
  return /^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", `'"'"'`)}'`;
}
