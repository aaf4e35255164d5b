"use strict";
// Sliders ask the server for a moment of the drive; each answer has the image, the estimates and the advice.
const at = id => document.getElementById(id);
const MOST_FRAMES = 40, NEAREST = 20, FARTHEST = 4000;
const chosen = new Map();  // what has been moved by hand, by its name in the query
const sliders = {
  // From the place of a slider to the value of its key, back, and as text.
  visibility: {value: p => NEAREST * (FARTHEST / NEAREST) ** p, place: v => share(v), text: metres},
  light: {value: p => 10 ** p, place: v => Math.log10(Math.max(v, 0.01)), text: v => `${v < 1 ? v.toPrecision(1) : nice(v)} lx`},
  height: {value: p => p, place: v => v, text: v => `${v.toFixed(2)} m`},
  pitch: {value: p => p, place: v => v, text: v => `${v.toFixed(1)}°`},
  pitch_error: {value: p => p, place: v => v, text: v => `${v > 0 ? "+" : ""}${v.toFixed(2)}°`},
};
const page = String(Math.random()).slice(2);  // the server gives up older questions of the same page alone
let onTheWay = 0, wanted = null, asked = 0, shown = 0, later = 0, plays = 0, playing = false;

function nice(v) { return Number(v.toPrecision(3)).toLocaleString("en"); }
function metres(v) { return v === null || v >= 10000 ? "clear" : `${nice(v)} m`; }
function span(found) {
  if (found.low === null) return "";
  return found.high === null || found.high >= 10000 ? `> ${nice(found.low)}` : `${nice(found.low)} – ${nice(found.high)}`;
}
function share(v) { return v === null ? 1 : Math.min(Math.max(Math.log(v / NEAREST) / Math.log(FARTHEST / NEAREST), 0), 1); }

// Two at most are on their way: the newer one makes the server give up the older one.
async function ask(frames) {
  wanted = frames;
  if (onTheWay === 2) return;
  onTheWay += 1;
  while (wanted !== null) {
    const number = ++asked, frames = wanted, query = `answer?${choices()}&frames=${frames}&soon=on&page=${page}`;
    wanted = null;
    const slow = setTimeout(() => { at("working").hidden = false; }, 800);
    const answer = await fetch(query).then(response => response.json()).catch(() => null);
    clearTimeout(slow);
    at("working").hidden = true;
    if (answer === null) { trouble("The server has ended: start fogsim explore again."); play(false); }
    else if (number > shown && !answer.outdated) { shown = number; show(answer, frames); }
  }
  onTheWay -= 1;
}

function choices() {
  const query = new URLSearchParams([["time", at("time").value], ...chosen]);
  if (at("lamps-of-ego").value) query.set("lamps", at("lamps-of-ego").value);
  if (at("rear-fog").checked) query.set("rear_fog", "on");
  return query;
}

function changed() { clearTimeout(later); ask(1); }

// At once by one frame, and when the hand rests and all methods are calibrated, by those of the last seconds, too.
function goOn(answer, frames) {
  clearTimeout(later);
  if (playing) return;
  const calibrating = answer.calibrating.length > 0;
  if (calibrating || frames === 1) later = setTimeout(() => ask(calibrating ? 1 : MOST_FRAMES), 600);
  // A page that is loaded again goes on from here.
  else history.replaceState(null, "", `#${choices()}`);
}

function trouble(text) { at("trouble").textContent = text; at("trouble").hidden = !text; }

function show(answer, frames) {
  trouble(answer.error ?? answer.fault);
  if (answer.error) return;
  goOn(answer, frames);
  document.title = `${answer.scenario} · FogSim`;
  at("scenario").textContent = answer.scenario;
  at("description").textContent = at("description").title = answer.description;
  at("frame").src = answer.image;
  at("time").max = answer.duration;
  at("time-text").textContent = at("time").ariaValueText = `${answer.time.toFixed(1)} of ${answer.duration.toFixed(0)} s`;
  for (const [name, slider] of Object.entries(sliders)) {
    const value = answer.values[name];
    if (!chosen.has(name)) at(name).value = slider.place(value);
    at(`${name}-text`).textContent = at(name).ariaValueText = slider.text(chosen.has(name) ? Number(chosen.get(name)) : value);
  }
  at("day-note").textContent = answer.values.light >= 1000 ? "not drawn by day" : "";
  const left = answer.calibrating.length ? `, without ${answer.calibrating.join(" and ")} (being calibrated)` : "";
  at("frames").textContent = (answer.frames === 1 ? "From this frame alone" : `From the last ${answer.frames} frames`) + left + ".";
  at("own-fog").hidden = !chosen.has("visibility");
  const truth = answer.values.visibility;
  const rows = answer.estimates.map(e => row(e.method, e, truth, e.visibility === null ? e.reason : ""));
  rows.push(row("all together", answer.belief, truth, answer.belief.informed ? "" : "too uncertain to act on"));
  rows.at(-1).classList.add("belief");
  at("estimates").replaceChildren(...rows);
  advise(answer.advice);
  at("command").textContent = answer.command;
}

function row(name, found, truth, why) {
  const line = element("div", "row method"), track = element("div", "track");
  const mark = element("div", "truth"); mark.style.left = percent(truth); track.append(mark);
  if (found.visibility !== null || found.high !== null || found.low > NEAREST) {
    const bar = element("div", "bar");
    bar.style.left = percent(found.low); bar.style.right = `${100 - 100 * share(found.high)}%`;
    track.append(bar);
  }
  const known = found.visibility !== null || found.informed;
  if (known) { const dot = element("div", "dot"); dot.style.left = percent(found.visibility); track.append(dot); }
  line.classList.toggle("silent", !known);
  const text = element("output", "", known ? metres(found.visibility) : "no estimate");
  if (known) text.append(element("small", "", span(found)));
  line.append(element("span", "", name), track, text);
  if (why) line.append(element("div", "why", why));
  return line;
}

function advise(advice) {
  at("speed").firstElementChild.textContent = Math.round(advice.own_speed);
  at("sign").firstElementChild.textContent = advice.speed === null ? "–" : Math.round(advice.speed);
  at("sign").classList.toggle("free", advice.speed === null);
  const limit = advice.limit === null ? "" : `, limit ${Math.round(advice.limit)} km/h`;
  at("advice").textContent = (advice.speed === null ? "no advice" : `${Math.round(advice.speed)} km/h`) + limit;
  at("lamps").textContent = advice.lamps.filter(Boolean).join(", ") || "none";
  at("warning").textContent = advice.warning.replaceAll("_", " ") || "none";
  at("warning").classList.toggle("alarm", Boolean(advice.warning));
}

function percent(visibility) { return `${100 * share(visibility)}%`; }

function element(tag, kind, text = "") {
  const made = document.createElement(tag);
  made.className = kind; made.textContent = text;
  return made;
}

for (const [name, slider] of Object.entries(sliders)) {
  at(name).addEventListener("input", event => {
    chosen.set(name, String(Number(slider.value(Number(event.target.value)).toPrecision(3))));
    changed();
  });
}
for (const id of ["time", "lamps-of-ego", "rear-fog"]) at(id).addEventListener("input", changed);
at("own-fog").addEventListener("click", () => { chosen.delete("visibility"); changed(); });
at("reset").addEventListener("click", () => { chosen.clear(); at("lamps-of-ego").value = ""; at("rear-fog").checked = false; changed(); });
at("copy").addEventListener("click", async () => {
  const done = await navigator.clipboard.writeText(at("command").textContent).then(() => "Copied", () => "Not allowed here");
  at("copy").textContent = done; setTimeout(() => { at("copy").textContent = "Copy the command"; }, 1500);
});
function play(on) {
  playing = on;
  at("play").textContent = playing ? "❚❚" : "▶";
  at("play").setAttribute("aria-label", playing ? "Pause" : "Play");
}

at("play").addEventListener("click", async () => {
  play(!playing);
  const mine = ++plays;
  while (playing && mine === plays && Number(at("time").value) < Number(at("time").max)) {
    const begun = performance.now();
    await ask(1);
    // As fast as in reality, where the computer is fast enough.
    const passed = Math.min(Math.max(Math.ceil((performance.now() - begun) / 100), 1), 10);
    at("time").value = Number(at("time").value) + passed / 10;
    await new Promise(done => setTimeout(done, Math.max(100 * passed - (performance.now() - begun), 0)));
  }
  // Another click may have begun to play again meanwhile.
  if (mine !== plays) return;
  play(false);
  changed();
});

for (const visibility of [20, 50, 100, 200, 400, 1000, 4000]) {
  const mark = element("i", "", visibility < 1000 ? String(visibility) : `${visibility / 1000} km`);
  mark.style.left = percent(visibility); at("axis").append(mark);
}
at("time").max = 86400;
const begun = new URLSearchParams(location.hash.includes("=") ? location.hash.slice(1) : `time=${location.hash.slice(1)}`);
at("time").value = Number(begun.get("time")) || 0;
for (const [name, slider] of Object.entries(sliders)) {
  const value = Number(begun.get(name) ?? NaN);
  if (Number.isFinite(value)) { chosen.set(name, String(value)); at(name).value = slider.place(value); }
}
at("lamps-of-ego").value = begun.get("lamps") ?? "";
at("rear-fog").checked = begun.has("rear_fog");
changed();
