// Events and numbers in plain words. An event that is not listed here is shown with the text that it came with.

const NAMES = { running: "the robots drive", paused: "paused", waiting: "waiting for go", over: "the run is over" };
const TROUBLE = new Set(["contact", "lost", "gone", "stale", "stalled", "unreachable", "edit_refused", "request_refused", "traffic_fault", "false_claim", "overdue", "jam"]);

/** Return an event as {text, trouble}. */
export function said(event) {
  let text = event.text;
  if (event.kind === "phase") text = NAMES[text.split(" ").at(-1)] ?? text;
  if (event.kind === "edit") text = edited(text);
  if (event.robot && !text.startsWith(event.robot)) text = `${event.robot} ${text}`;
  return { text, trouble: TROUBLE.has(event.kind) };
}

function edited(text) {
  const found = text.match(/^(\w+) from \(([-\d.e]+), ([-\d.e]+)\) to \(([-\d.e]+), ([-\d.e]+)\)/);
  if (!found) return text;
  const [, kind, x0, y0, x1, y1] = found, size = (a, b) => Math.abs(b - a).toFixed(1);
  const what = { wall: "a wall was put up", obstacle: "an obstacle was put up", free: "the floor was cleared" }[kind] ?? kind;
  return `${what}, ${size(x0, x1)} x ${size(y0, y1)} m at (${((+x0 + +x1) / 2).toFixed(1)}, ${((+y0 + +y1) / 2).toFixed(1)})`;
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

/** Return a count with its word: "1 robot", "3 robots". */
export function count(value, word) {
  return `${value} ${word}${value === 1 ? "" : "s"}`;
}
