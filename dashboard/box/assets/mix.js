// A fleet of several kinds: a field for each kind says how many robots of it will be driven, and a sign how they look.

import { changed, kindNames, mixOf, radiusOfKind, shapeOf } from "./kinds.js";
import { state, wantedMix } from "./state.js";
import { setMix } from "./tools.js";
import { count } from "./words.js";

const $ = (id) => document.getElementById(id);

let built = ""; // the kinds whose fields there are

function made(tag, parts, ...children) {
  const node = Object.assign(document.createElement(tag), parts);
  node.append(...children);
  return node;
}

function icon(kind) {
  const sign = made("i", { className: "icon kind" });
  sign.dataset.shape = shapeOf(state.floor, kind);
  return sign;
}

function field(kind, page) {
  const input = made("input", { type: "number", min: 0, max: 1000, inputMode: "numeric", title: `how many robots of the kind ${kind}` });
  input.dataset.kind = kind;
  input.addEventListener("change", () => {
    page.carry((async () => {
      const wished = input.value === "" ? NaN : Number(input.value);
      if (wished !== (wantedMix()[kind] ?? 0)) setMix(changed(wantedMix(), kind, wished));
    })());
  });
  input.addEventListener("keydown", (event) => {
    if (event.key === "Enter") input.blur(); // it is asked for, and the keys steer the page again
  });
  return made("label", { className: "field" }, made("span", { className: "kind" }, icon(kind), kind), input);
}

/** Let the fields and signs show the mix; a fleet without kinds has the field `robots` instead. */
export function refresh(page) {
  const kinds = kindNames(state.floor), told = JSON.stringify(kinds);
  $("robots").parentElement.hidden = kinds.length > 0;
  if (built !== told) {
    built = told;
    $("mix").replaceChildren(...kinds.map((kind) => field(kind, page)));
    $("kinds").replaceChildren(...kinds.map((kind) => made("li", {}, icon(kind), made("span", {}))));
  }
  const mix = wantedMix(), there = mixOf(state.floor);
  kinds.forEach((kind, at) => {
    const input = $("mix").children[at].querySelector("input"), words = $("kinds").children[at].lastChild;
    if (document.activeElement !== input && input.value !== String(mix[kind] ?? 0)) input.value = mix[kind] ?? 0;
    const text = `${kind}: ${count(there[kind] ?? 0, "robot")}, ${radiusOfKind(state.floor, kind).toFixed(2)} m in radius`;
    if (words.textContent !== text) words.textContent = text;
  });
}
