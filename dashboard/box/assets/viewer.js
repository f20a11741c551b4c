// The tab with Rerun's viewer: it starts when the tab is first opened, and stays as it is behind the box.

import { ask } from "./link.js";

const $ = (id) => document.getElementById(id);

let frame = null;
let asked = 0; // how often a tab was chosen: an answer for another one than the last is too late

/** Show the box, or Rerun in its place; throw an Error with a sentence if there is no viewer. */
export async function view(name) {
  const mine = ++asked;
  document.documentElement.dataset.view = name;
  for (const tab of ["floor", "rerun"]) $(`tab_${tab}`).setAttribute("aria-selected", String(tab === name));
  $("rerun").hidden = name !== "rerun";
  if (name !== "rerun") return;
  $("rerun_said").textContent = frame ? "" : "Rerun's viewer starts. Without a graphics card its first picture takes up to half a minute.";
  try {
    const { address } = await ask("/viewer", {});
    if (mine === asked && frame?.src !== here(address)) open(address);
  } catch (fault) {
    if (mine === asked) view("floor");
    throw fault;
  }
}

/** Open the viewer under the other name of this machine: a browser then gives it a process of its own. */
function open(address) {
  frame?.remove();
  frame = document.createElement("iframe");
  frame.title = "Rerun";
  frame.allow = "fullscreen; clipboard-write";
  frame.src = here(address);
  $("rerun").append(frame);
}

function here(address) {
  const there = new URL(address);
  there.hostname = location.hostname === "localhost" ? "127.0.0.1" : "localhost";
  return there.href;
}
