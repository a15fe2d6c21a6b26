"use strict";
const DATA = JSON.parse(document.getElementById("data").textContent);
const byId = (id) => document.getElementById(id);
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
const MOST_MINIMA = 6;
const state = { sequence: 0, camera: 0, frame: 0, playing: false, images: new Map(), yaw: 0.7, pitch: -0.45 };

const sequence = () => DATA.sequences[state.sequence];
const camera = () => sequence().cameras[state.camera] || { frames: [], pictures: [], size: null };
const picture = () => camera().pictures[state.frame];
const reportOf = (frame) => camera().frames.find((entry) => entry.frame === frame);

function element(name, attributes, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes || {})) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

function table(heads, rows) {
  const head = element("tr", {}, ...heads.map((text) => element("th", { scope: "col" }, text)));
  const body = rows.map((row) => element("tr", {}, ...row.map((cell, k) => {
    const made = element(k ? "td" : "th", k ? {} : { scope: "row" });
    made.append(cell);
    return made;
  })));
  return element("div", { class: "scroll" }, element("table", {}, element("thead", {}, head), element("tbody", {}, ...body)));
}

/* The frame and the outlines over it */

function imageOf(shown) {
  if (!shown.image) return null;
  if (!state.images.has(shown)) {
    const image = new Image();
    image.onload = drawPlayer;
    image.src = shown.image;
    state.images.set(shown, image);
  }
  return state.images.get(shown);
}

function tracePolygon(context, points, window, scale) {
  context.beginPath();
  for (let k = 0; k < points.length; k += 2) {
    context.lineTo((points[k] - window[0] + 0.5) * scale, (points[k + 1] - window[1] + 0.5) * scale);
  }
  context.closePath();
}

/* Where there are outlines and no pictures, the silhouette itself stands for the picture. */
function fillObserved(context, shown, scale) {
  if (!shown.observed) return;
  tracePolygon(context, shown.observed, shown.window, scale);
  context.fillStyle = colour("line");
  context.fill();
}

function drawPolygon(context, points, window, scale, style, dashed) {
  if (!points) return;
  tracePolygon(context, points, window, scale);
  context.setLineDash(dashed ? [7, 5] : []);
  context.lineWidth = 2.5;
  context.strokeStyle = style;
  context.stroke();
  context.setLineDash([]);
}

function drawPlayer() {
  const canvas = byId("player"), context = canvas.getContext("2d"), shown = picture();
  context.fillStyle = colour("ground");
  context.fillRect(0, 0, canvas.width, canvas.height);
  if (!shown) return drawNothing(context, canvas);
  const scale = canvas.width / shown.window[2], image = imageOf(shown);
  context.imageSmoothingEnabled = false;
  if (image && image.complete) context.drawImage(image, 0, 0, canvas.width, canvas.height);
  if (!shown.image) fillObserved(context, shown, scale);
  if (byId("show-observed").checked) drawPolygon(context, shown.observed, shown.window, scale, colour("observed"), true);
  if (byId("show-estimated").checked) drawPolygon(context, shown.estimated, shown.window, scale, colour("estimated"), false);
  drawInset(context, canvas, shown);
}

function drawNothing(context, canvas) {
  context.fillStyle = colour("soft");
  context.font = "18px system-ui, sans-serif";
  context.textAlign = "center";
  context.fillText("The pictures were not at hand when this report was made.", canvas.width / 2, canvas.height / 2);
}

/* Where in the whole picture the shown square lies. */
function drawInset(context, canvas, shown) {
  const size = camera().size;
  if (!size || shown.window[2] >= Math.max(...size)) return;
  const scale = 110 / Math.max(...size), left = canvas.width - size[0] * scale - 10, top = 10;
  context.fillStyle = colour("panel");
  context.globalAlpha = 0.8;
  context.fillRect(left, top, size[0] * scale, size[1] * scale);
  context.globalAlpha = 1;
  context.lineWidth = 1;
  context.strokeStyle = colour("soft");
  context.strokeRect(left, top, size[0] * scale, size[1] * scale);
  context.strokeStyle = colour("estimated");
  context.lineWidth = 2;
  context.strokeRect(left + shown.window[0] * scale, top + shown.window[1] * scale, shown.window[2] * scale, shown.window[2] * scale);
}

function labelFrame() {
  const shown = picture(), label = byId("frame-label");
  if (!shown) { label.textContent = ""; return; }
  const report = reportOf(shown.frame);
  const parts = ["Frame " + shown.frame];
  if (report && report.time_ms !== null) parts.push(report.time_ms.toFixed(2) + " ms");
  if (report && report.used && report.rms !== null) parts.push("RMS ETE " + report.rms.toFixed(2) + " px");
  if (report && report.reason) parts.push((report.used ? "used in part: " : "left out: ") + report.reason);
  label.textContent = parts.join(" · ");
}

function show(frame) {
  const count = camera().pictures.length;
  state.frame = count ? (frame + count) % count : 0;
  byId("seek").value = state.frame;
  labelFrame();
  drawPlayer();
  drawErrors();
  drawTrajectory();
}

function play(on) {
  state.playing = on;
  byId("play").textContent = on ? "Pause" : "Play";
  byId("play").setAttribute("aria-pressed", String(on));
}

setInterval(() => { if (state.playing) show(state.frame + 1); }, 90);

/* The error of each frame */

function errorScale() {
  const frames = camera().frames;
  const values = frames.filter((entry) => entry.used && entry.rms !== null).map((entry) => entry.rms);
  const top = Math.max(1, ...values) * 1.15;
  const last = Math.max(1, ...frames.map((entry) => entry.frame));
  return { left: 44, right: 630, top: 10, bottom: 190, highest: top, last };
}

const errorX = (scale, frame) => scale.left + (scale.right - scale.left) * frame / scale.last;
const errorY = (scale, value) => scale.bottom - (scale.bottom - scale.top) * value / scale.highest;

function niceStep(range, count) {
  const rough = range / count, power = Math.pow(10, Math.floor(Math.log10(rough)));
  return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= rough);
}

function drawErrors() {
  const canvas = byId("errors"), context = canvas.getContext("2d"), scale = errorScale();
  context.clearRect(0, 0, canvas.width, canvas.height);
  context.font = "13px system-ui, sans-serif";
  drawErrorAxes(context, scale);
  for (const entry of camera().frames) {
    const known = entry.used && entry.rms !== null;
    context.fillStyle = colour(entry.used ? "estimated" : "left-out");
    context.beginPath();
    if (known) context.arc(errorX(scale, entry.frame), errorY(scale, entry.rms), 3, 0, 7);
    else context.rect(errorX(scale, entry.frame) - 1.5, scale.bottom - 14, 3, 14);
    context.fill();
  }
  const shown = picture();
  if (!shown) return;
  context.fillStyle = colour("ink");
  context.fillRect(errorX(scale, shown.frame), scale.top, 1, scale.bottom - scale.top);
}

function drawErrorAxes(context, scale) {
  const step = niceStep(scale.highest, 4);
  context.strokeStyle = colour("line");
  context.lineWidth = 1;
  context.fillStyle = colour("soft");
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (let value = 0; value <= scale.highest; value += step) {
    context.strokeRect(scale.left, errorY(scale, value), scale.right - scale.left, 0);
    context.fillText(value.toFixed(step < 1 ? 1 : 0), scale.left - 8, errorY(scale, value));
  }
  context.textBaseline = "top";
  context.textAlign = "center";
  const across = Math.max(1, niceStep(scale.last, 6));
  for (let frame = 0; frame <= scale.last; frame += across) context.fillText(String(frame), errorX(scale, frame), scale.bottom + 8);
}

/* The trajectory in three dimensions, orthographic */

function turned(point) {
  const [x, y, z] = point;
  const a = Math.cos(state.yaw) * x + Math.sin(state.yaw) * z, b = -Math.sin(state.yaw) * x + Math.cos(state.yaw) * z;
  return [a, Math.cos(state.pitch) * y - Math.sin(state.pitch) * b];
}

function bounds() {
  const all = [...(sequence().trajectory ? sequence().trajectory.x_mm : []), ...(sequence().true_trajectory ? sequence().true_trajectory.x_mm : [])];
  const low = [0, 1, 2].map((k) => Math.min(...all.map((p) => p[k]))), high = [0, 1, 2].map((k) => Math.max(...all.map((p) => p[k])));
  const middle = low.map((value, k) => (value + high[k]) / 2);
  return { middle, half: Math.max(1e-6, ...high.map((value, k) => (value - low[k]) / 2)), low, high };
}

function drawTrajectory() {
  const canvas = byId("trajectory"), context = canvas.getContext("2d");
  context.clearRect(0, 0, canvas.width, canvas.height);
  const estimated = sequence().trajectory, truth = sequence().true_trajectory;
  if (!estimated && !truth) return drawNoMotion(context, canvas);
  const box = bounds(), size = 0.28 * Math.min(canvas.width, canvas.height) / box.half;
  const place = (point) => {
    const [a, b] = turned(point.map((value, k) => value - box.middle[k]));
    return [canvas.width / 2 + a * size, canvas.height / 2 + b * size];
  };
  drawAxes(context, box, place);
  if (truth) drawPath(context, truth.x_mm.map(place), colour("truth"), 7);
  if (estimated) {
    drawPath(context, estimated.x_mm.map(place), colour("estimated"), 2.5);
    drawPose(context, estimated, place, box.half * 0.3);
  }
}

function drawNoMotion(context, canvas) {
  context.fillStyle = colour("soft");
  context.font = "18px system-ui, sans-serif";
  context.textAlign = "center";
  context.fillText("There is no motion to show.", canvas.width / 2, canvas.height / 2);
}

function drawPath(context, points, style, width) {
  context.beginPath();
  for (const [x, y] of points) context.lineTo(x, y);
  context.strokeStyle = style;
  context.lineWidth = width;
  context.globalAlpha = width > 4 ? 0.45 : 1;
  context.stroke();
  context.globalAlpha = 1;
}

/* The body's principal axes at the frame shown. */
function drawPose(context, motion, place, length) {
  const shown = picture(), frame = Math.min(shown ? shown.frame : 0, motion.x_mm.length - 1);
  const centre = motion.x_mm[frame], [x, y, z, w] = motion.q[frame];
  const axes = [
    [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)],
    [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)],
    [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)],
  ];
  for (const [k, axis] of axes.entries()) {
    drawPath(context, [place(centre), place(centre.map((value, j) => value + axis[j] * length))], colour("ink"), 1 + k);
  }
  const [a, b] = place(centre);
  context.fillStyle = colour("estimated");
  context.beginPath();
  context.arc(a, b, 5, 0, 7);
  context.fill();
}

function drawAxes(context, box, place) {
  const corner = box.middle.map((value) => value - box.half);
  const step = niceStep(2 * box.half, 4);
  context.font = "13px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  ["x", "y", "z"].forEach((name, k) => {
    const along = (value) => corner.map((start, j) => (j === k ? value : start));
    drawPath(context, [place(corner), place(along(corner[k] + 2 * box.half))], colour("soft"), 1);
    context.fillStyle = colour("soft");
    for (let value = Math.ceil(corner[k] / step) * step; value < corner[k] + 2 * box.half; value += step) {
      const [a, b] = place(along(value));
      context.fillRect(a - 1.5, b - 1.5, 3, 3);
      context.fillText(value.toFixed(step < 1 ? 1 : 0), a + (k === 1 ? -20 : 0), b + (k === 1 ? 0 : 13));
    }
    const [a, b] = place(along(corner[k] + 2.25 * box.half));
    context.fillStyle = colour("ink");
    context.fillText(name, a, b);
  });
}

/* Words and tables */

function intervalPicture(row) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 190 22");
  svg.setAttribute("aria-hidden", "true");
  if (!(row.sigma > 0)) return svg;
  const off = row.true === null ? 0 : (row.true - row.value) / row.sigma;
  const scale = 85 / Math.max(3, Math.abs(off) * 1.15), half = 1.959964 * scale;
  const mark = (x, y, width, height, name) => {
    const bar = document.createElementNS("http://www.w3.org/2000/svg", "rect");
    Object.entries({ x, y, width, height, fill: colour(name) }).forEach(([key, value]) => bar.setAttribute(key, value));
    svg.append(bar);
  };
  mark(95 - half, 10, 2 * half, 2, "estimated");
  mark(95 - half, 6, 1, 10, "estimated");
  mark(95 + half - 1, 6, 1, 10, "estimated");
  mark(93, 8, 4, 6, "estimated");
  if (row.true !== null) mark(94 + off * scale, 2, 3, 18, "truth");
  return svg;
}

function fillVelocities() {
  const section = byId("velocities");
  section.replaceChildren();
  const withTruth = sequence().velocities.some((part) => part.rows.some((row) => row.true !== null));
  for (const part of sequence().velocities) {
    const heads = ["", "estimate ± σ", "95 % interval", "", ...(withTruth ? ["truth", "error / σ"] : [])];
    const rows = part.rows.map((row) => {
      const cells = [row.label + ", " + row.unit, row.text, row.interval, element("div", { class: "interval" }, intervalPicture(row))];
      return withTruth ? [...cells, row.true_text, row.pull] : cells;
    });
    section.append(element("h2", {}, part.heading), table(heads, rows));
  }
  if (section.childElementCount) section.append(element("p", { class: "caption" }, "World frame, which is the first camera's. Angular velocity is given in the world frame too."));
}

function fillVerdict() {
  const now = sequence(), section = byId("verdict");
  section.className = now.status === "converged" ? "good" : "bad";
  const title = element("h2", {}, now.name + ": ", element("span", { class: "status " + section.className, id: "status" }, now.status));
  const words = [element("p", {}, now.meaning)];
  if (now.message && now.message !== now.status + ".") words.push(element("p", { id: "message" }, now.message));
  const next = element("ul", { id: "next" }, ...now.next.map((text) => element("li", {}, text)));
  section.replaceChildren(title, ...words, element("p", {}, "What to do next:"), next);
}

function ranges(frames) {
  const found = [];
  for (const frame of frames) {
    const last = found[found.length - 1];
    if (last && frame === last[1] + 1) last[1] = frame;
    else found.push([frame, frame]);
  }
  return found.map(([a, b]) => (a === b ? String(a) : a + "–" + b)).join(", ");
}

function fillLeftOut() {
  const section = byId("left-out"), reasons = new Map();
  sequence().cameras.forEach((seen) => seen.frames.filter((entry) => !entry.used).forEach((entry) => {
    const key = seen.name + "\u0000" + entry.reason;
    reasons.set(key, [...(reasons.get(key) || []), entry.frame]);
  }));
  const heading = element("h2", {}, "Frames left out");
  if (!reasons.size) { section.replaceChildren(heading, element("p", { class: "caption" }, "None.")); return; }
  const rows = [...reasons].map(([key, frames]) => [...key.split("\u0000"), String(frames.length), ranges(frames)]);
  section.replaceChildren(heading, table(["camera", "reason", "count", "frames"], rows));
}

function fillMinima() {
  const minima = sequence().minima, section = byId("minima");
  section.replaceChildren();
  if (!minima) return;
  const words = "Poses in which the search for the first pose ended, best first. Where the second comes near the first, the pictures leave a choice.";
  const few = minima.rows.slice(0, MOST_MINIMA), more = minima.rows.length - few.length;
  section.append(element("h2", {}, "Competing minima"), table(minima.columns, few));
  section.append(element("p", { class: "caption" }, words + (more > 0 ? (more === 1 ? " One that is worse is not shown." : " " + more + " that are worse are not shown.") : "")));
}

const NOTES = {
  "Fitted parameters": "At the reference time of the fit. theta is the turn from the estimated pose, so it is zero; com and inertia are departures from the visual hull's.",
};

function fillDetails() {
  const now = sequence(), section = byId("details");
  const parts = [["Fitted parameters", ["parameter", "value", "standard deviation"], now.parameters], ["Statistics", ["name", "value"], now.statistics],
    ["Configuration", ["name", "value"], now.configuration], ["Versions", ["software", "version"], now.versions]];
  section.replaceChildren(element("h2", {}, "How it was made"), ...parts.filter(([, , rows]) => rows.length).map(([title, heads, rows]) =>
    element("details", {}, element("summary", {}, title), table(heads, rows), element("p", { class: "caption" }, NOTES[title] || ""))));
}

function pick(number) {
  Object.assign(state, { sequence: number, camera: 0, frame: 0 });
  state.images.clear();
  document.querySelectorAll("#index tbody tr").forEach((row, k) => row.setAttribute("aria-current", String(k === number)));
  byId("camera").replaceChildren(...sequence().cameras.map((seen, k) => element("option", { value: k }, seen.name)));
  byId("camera-choice").hidden = sequence().cameras.length < 2;
  byId("truth-key").hidden = !sequence().true_trajectory;
  [fillVerdict, fillVelocities, fillLeftOut, fillMinima, fillDetails].forEach((fill) => fill());
  pickCamera(0);
}

function pickCamera(number) {
  state.camera = number;
  byId("seek").max = Math.max(0, camera().pictures.length - 1);
  byId("observed-key").hidden = !camera().pictures.some((shown) => shown.observed);
  show(0);
}

function listen() {
  document.querySelectorAll(".pick").forEach((button) => button.addEventListener("click", () => pick(Number(button.dataset.sequence))));
  byId("play").addEventListener("click", () => play(!state.playing));
  byId("back").addEventListener("click", () => show(state.frame - 1));
  byId("forth").addEventListener("click", () => show(state.frame + 1));
  byId("seek").addEventListener("input", (event) => show(Number(event.target.value)));
  byId("camera").addEventListener("change", (event) => pickCamera(Number(event.target.value)));
  ["show-estimated", "show-observed"].forEach((id) => byId(id).addEventListener("change", drawPlayer));
  byId("errors").addEventListener("click", (event) => seekByError(event));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => pick(state.sequence));
  listenToTurns(byId("trajectory"));
}

function seekByError(event) {
  const canvas = byId("errors"), scale = errorScale();
  const x = event.offsetX * canvas.width / canvas.clientWidth;
  const frame = (x - scale.left) / (scale.right - scale.left) * scale.last;
  const distances = camera().pictures.map((shown) => Math.abs(shown.frame - frame));
  if (distances.length) show(distances.indexOf(Math.min(...distances)));
}

function turn(yaw, pitch) {
  state.yaw += yaw;
  state.pitch = Math.max(-1.5, Math.min(1.5, state.pitch + pitch));
  drawTrajectory();
}

function listenToTurns(canvas) {
  let last = null;
  canvas.addEventListener("pointerdown", (event) => { last = [event.clientX, event.clientY]; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointermove", (event) => {
    if (!last) return;
    turn((event.clientX - last[0]) * 0.01, (event.clientY - last[1]) * 0.01);
    last = [event.clientX, event.clientY];
  });
  canvas.addEventListener("pointerup", () => { last = null; });
  canvas.addEventListener("keydown", (event) => {
    const turns = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[event.key];
    if (turns) { turn(...turns); event.preventDefault(); }
  });
}

listen();
if (DATA.sequences.length) pick(0);
