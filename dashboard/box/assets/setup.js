// From a drawing to a run: the draft is asked for with `fleet/setup`, then go. Each step is a request of the wire.

import { drawing } from "./floor.js";
import { ask, text } from "./link.js";
import { isDrafted, phase, state, wanted } from "./state.js";

const PATIENCE = 60000; // ms for a fleet to start again
const LOOK = 50; // ms between two looks whether it has

/** Ask for what is drawn; wait until the fleet has started again with it. A fleet that drives is paused before. */
export async function apply() {
  if (!isDrafted()) return;
  const asked = { scenario: null, ...state.draft };
  if (!asked.scenario) keepFloor(asked);
  const before = state.clock?.run ?? -1;
  if (phase() === "running") await ask("/action", { do: "pause" });
  await ask("/setup", asked);
  state.draft = {};
  state.nextStart = 0;
  await until(() => state.clock && state.clock.run > before && state.clock.phase === "waiting" && isComplete(),
    "the fleet has not started again; see the terminal");
}

/** A set-up begins with the floor of its scenario: add the floor as it is now, if walls were drawn since. */
function keepFloor(asked) {
  const now = state.floor && drawing(state.floor);
  if (now && state.floor.edits && now.trim() !== state.setup?.map?.trim()) {
    asked.map = now;
    asked.cell = state.floor.resolution;
  }
}

function isComplete() {
  const { robots, present } = state.clock;
  return robots.length > 0 && robots.every((robot) => present.includes(robot));
}

async function until(fits, otherwise) {
  for (let waited = 0; !fits(); waited += LOOK) {
    if (waited > PATIENCE) throw new Error(otherwise);
    await new Promise((done) => setTimeout(done, LOOK));
  }
}

/** Begin: what is drawn first, if anything is. */
export async function go() {
  if (!hasStops()) throw new Error("there is no target yet: choose target, click on the floor, then press go");
  await apply();
  return (await ask("/action", { do: "go" })).text;
}

function hasStops() {
  if (state.draft.scenario) return true; // its own targets
  if (wanted("targets")?.length) return true;
  const { own_targets: own, start, pool, orders, kinds } = state.floor?.settings ?? {};
  const ofKinds = Object.values(kinds ?? {}).some((kind) => kind.targets?.length);
  return !state.draft.targets && Boolean(own?.length || ofKinds || start?.circle || pool?.length || orders?.length);
}

/** Download what is set up as a scenario file. */
export async function save() {
  await apply();
  const file = await text("/scenario"), link = document.createElement("a");
  const address = URL.createObjectURL(new Blob([file], { type: "text/yaml" }));
  link.href = address;
  link.download = `${state.setup?.scenario ?? "box"}.yaml`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
  return `saved as ${link.download}: swarm run ${link.download}`;
}
