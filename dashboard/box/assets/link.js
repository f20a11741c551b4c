// The connection to the box's server: frames that come, requests that go. It connects again until it is told not to.

const token = new URLSearchParams(location.search).get("token") ?? "";
const AGAIN = 1000; // ms between two attempts

let socket = null;
let selected = null;

/** Call `take(key, message)` for each frame, and `changed(up)` when the connection comes or goes, while `goesOn()`. */
export function connect(take, changed, goesOn) {
  socket = new WebSocket(`ws://${location.host}/live?token=${encodeURIComponent(token)}`);
  socket.onopen = () => {
    changed(true);
    select(selected);
  };
  socket.onmessage = (event) => {
    const { key, message } = JSON.parse(event.data);
    take(key, message);
  };
  socket.onclose = () => {
    changed(false);
    if (goesOn()) setTimeout(() => connect(take, changed, goesOn), AGAIN);
  };
}

/** Tell the server which robot's rules this page shows; null: none. */
export function select(robot) {
  selected = robot;
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ select: robot }));
}

async function fetched(path, options = {}) {
  let response;
  try {
    response = await fetch(path, { ...options, headers: { Authorization: `Bearer ${token}` } });
  } catch {
    throw new Error("the box does not answer; is the fleet still running?");
  }
  if (!response.ok) {
    const told = await response.json().catch(() => ({}));
    throw new Error(told.refused ?? `${path}: ${response.status} ${response.statusText}`);
  }
  return response;
}

/** Send a request of the wire and return its answer; throw an Error with the sentence of a refusal. */
export async function ask(path, message) {
  return (await fetched(path, { method: "POST", body: JSON.stringify(message) })).json();
}

/** Return the text of a path. */
export async function text(path) {
  return (await fetched(path)).text();
}
